# SPDX-License-Identifier: GPL-3.0-or-later
"""`assign`: put a bake's material on meshes of the open file."""

import argparse
from collections.abc import Iterable

import bpy

from ...precompute.base.failure import printable
from ...precompute.cli.arguments import add_progress, name_argument
from ...precompute.cli.printing import Progress
from ..gratings.grating import LIGHTS
from ..materials.holograms.hologram_nodes import input_set_by_artist
from ..materials.material import diffraction_nodes
from ..materials.skin import SETTABLE
from ..workflow.assigning import add_to_meshes, assign_to_meshes
from ..workflow.importing import bake_file, index_of
from ..workflow.lights.fitting_frames import fit_frames
from ..workflow.lights.lighting import warnings_about
from ..workflow.making_materials import refresh_group
from .chosen import add_objects, add_save, chosen_objects, save, setting


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `assign`."""
    parser.add_argument("bake", type=name_argument, metavar="BAKE", help="the .exr that `bake` wrote, or its folder")
    add_objects(parser)
    parser.add_argument(
        "--lights",
        choices=[name.lower() for name, _, _ in LIGHTS],
        help="rest: lamps without noise, other light by random samples; lamps: only lamps; all: every light by random "
        "samples, exact but noisy. Default: the grating's setting, rest for a new one",
    )
    parser.add_argument("--over", action="store_true", help="add the diffraction on top of the meshes' own materials")
    parser.add_argument(
        "--fit-frames",
        action="store_true",
        help="fit an animated world's bright parts in each frame of the scene's range, some seconds a frame",
    )
    parser.add_argument("--no-shadows", action="store_true", help="objects cast no shadows on the diffraction")
    parser.add_argument(
        "--set",
        action="append",
        type=name_argument,
        metavar="NAME=VALUE",
        help=f"set an input of the material, angles in degrees (repeatable): {', '.join(SETTABLE)}",
    )
    add_progress(parser)
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `assign` verb."""
    values = dict(setting(text, SETTABLE) for text in arguments.set or ())
    gratings = bpy.context.scene.natural_gratings
    bake_file(arguments.bake)
    chosen = chosen_objects(arguments.object)
    gratings.active_index = index = index_of(bpy.context.scene, arguments.bake)
    if arguments.lights:
        gratings.items[index].lights = arguments.lights.upper()
    if arguments.no_shadows:
        gratings.items[index].shadows = False
    refresh_group(gratings.items[index])
    put = add_to_meshes if arguments.over else assign_to_meshes
    report = put(bpy.context.scene, chosen)
    set_inputs(chosen, gratings.items[index].group, values)
    if arguments.fit_frames:
        report.append(fit_frames(bpy.context.scene, progress=Progress(arguments.progress)))
    report += warnings_about(bpy.context.scene, bpy.context.evaluated_depsgraph_get())
    save(arguments.save)
    print("\n".join(map(printable, report)))


def set_inputs(objects: Iterable[bpy.types.Object], group: bpy.types.NodeTree, values: dict[str, float]) -> None:
    """Set inputs of a grating's Diffraction nodes in the materials of objects."""
    materials = {slot.material for thing in objects for slot in thing.material_slots}
    for node in (node for material in materials for node in diffraction_nodes(material) if node.node_tree == group):
        for name, value in values.items():
            input_set_by_artist(node, name).default_value = value
