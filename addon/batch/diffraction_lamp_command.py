# SPDX-License-Identifier: GPL-3.0-or-later
"""`diffraction-lamp`: add a Diffraction Lamp to a mesh of the open file that shows a grating."""

import argparse

import bpy
from mathutils import Vector

from ...precompute.base.failure import GratingError, printable
from ...precompute.cli.arguments import name_argument, number
from ..workflow.lights.adding_diffraction_lamps import add_diffraction_lamp, shows_grating
from .chosen import add_save, save

_ANYWHERE = number(-1e6, 1e6)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `diffraction-lamp`."""
    parser.add_argument("--object", required=True, type=name_argument, metavar="NAME", help="a mesh with a grating")
    parser.add_argument(
        "--near", nargs=3, type=_ANYWHERE, metavar=("X", "Y", "Z"), default=None,
        help="place the patch where the mesh is nearest to this point, in metres; default: the 3D cursor",
    )  # fmt: skip
    parser.add_argument(
        "--size-mm", type=number(1e-3, 1e6), default=10.0, metavar="MM", help="side of the square patch; default 10"
    )
    parser.add_argument(
        "--lit-by", type=name_argument, metavar="LAMP", help="lamp whose light it diffracts; default: the first"
    )
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `diffraction-lamp` verb."""
    scene = bpy.context.scene
    mesh = scene.objects.get(arguments.object)
    if mesh is None or not shows_grating(mesh):
        raise GratingError(arguments.object, "no mesh of the scene with a grating", "use `assign` first")
    near = scene.cursor.location if arguments.near is None else Vector(arguments.near)
    _, report = add_diffraction_lamp(
        scene, mesh, bpy.context.evaluated_depsgraph_get(),
        near=near, size_m=arguments.size_mm * 1e-3, lamp_name=arguments.lit_by or "",
    )  # fmt: skip
    save(arguments.save)
    print("\n".join(map(printable, report)))
