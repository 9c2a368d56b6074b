# SPDX-License-Identifier: GPL-3.0-or-later
"""`assign`: put a bake's material on meshes of the open file."""

import argparse

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.cli.arguments import existing_bake
from ...precompute.cli.option_types import name_argument
from ..actions.assign import assign_to_meshes
from ..actions.lamps import warnings_about
from ..actions.material import refresh_group
from ..scene.gratings import kept_path
from ..scene.lights import LIGHTS
from .objects import add_objects, select_objects
from .save import add_save, save


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `assign`."""
    parser.add_argument("bake", type=name_argument, metavar="BAKE", help="the .exr that `bake` wrote, or its folder")
    add_objects(parser)
    parser.add_argument(
        "--lights",
        choices=[name.lower() for name, _, _ in LIGHTS],
        help="rest: lamps without noise, all else with little; lamps: lamps only; all: every light, noisy and exact. "
        "Default: as the grating has it, at first rest",
    )
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `assign` verb."""
    file = existing_bake(arguments.bake)
    if file is None:
        raise GratingError(f"{arguments.bake}: no bake there; give the .exr that `bake` wrote, or its folder")
    if arguments.object:
        select_objects(arguments.object)
    gratings = bpy.context.scene.natural_gratings
    path = kept_path(str(file.resolve()))
    index = next((i for i, g in enumerate(gratings.items) if g.bake_path == path), None)
    if index is None:
        grating = gratings.items.add()
        grating.name, grating.bake_path = printable(file.stem), path
        index = len(gratings.items) - 1
    gratings.active_index = index
    if arguments.lights:
        gratings.items[index].lights = arguments.lights.upper()
    refresh_group(gratings.items[index])
    selected = [o for o in bpy.context.view_layer.objects if o.select_get()]
    report = assign_to_meshes(bpy.context.scene, selected)
    report += warnings_about(bpy.context.scene, bpy.context.evaluated_depsgraph_get())
    save(arguments.save)
    print("\n".join(map(printable, report)))
