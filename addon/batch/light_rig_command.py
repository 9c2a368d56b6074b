# SPDX-License-Identifier: GPL-3.0-or-later
"""`light-rig`: add lamps to the open file where they make its camera see a grating's colours."""

import argparse

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.cli.arguments import number
from ..lamps.light_rig import SUN
from ..operators.light import KINDS
from ..workflow.lights.adding_diffraction_lamps import shows_grating
from ..workflow.lights.adding_light_rigs import Rig, add_light_rig, carriers
from .chosen import add_objects, add_save, chosen_meshes, save


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `light-rig`."""
    names = [name.lower() for name, _, _ in KINDS]
    parser.add_argument(
        "--kind", choices=names, default=SUN.lower(), metavar="KIND", help=f"one of {', '.join(names)}; default sun"
    )
    parser.add_argument(
        "--strength", type=number(0, 1e4), default=1.0, metavar="X", help="factor on the lamps' strength; default 1"
    )
    parser.add_argument(
        "--softness", type=number(0.01, 10), default=1.0, metavar="X", help="factor on the lamps' size; default 1"
    )
    add_objects(parser)
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `light-rig` verb. Without names it lights the active object, else all objects with a grating."""
    scene = bpy.context.scene
    objects = chosen_meshes(arguments.object) if arguments.object else carriers(scene, bpy.context.active_object)
    for each in objects:
        if not shows_grating(each):
            raise GratingError(each.name, "it shows no grating", "use `assign` first")
    rig = Rig(arguments.kind.upper(), arguments.strength, arguments.softness)
    report = add_light_rig(scene, bpy.context.evaluated_depsgraph_get(), rig, objects=objects)
    save(arguments.save)
    print("\n".join(map(printable, report)))
