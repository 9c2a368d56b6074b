# SPDX-License-Identifier: GPL-3.0-or-later
"""`sticker`: stick a piece of foil with a grating on meshes of the open file."""

import argparse
from math import radians

import bpy

from ...precompute.base.failure import printable
from ...precompute.cli.arguments import name_argument, number
from ...precompute.presets.presets import read_preset
from ..workflow.adding_things import FIRST, Sticker, add_sticker
from .chosen import add_objects, add_save, chosen_meshes, save


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `sticker`."""
    parser.add_argument(
        "--preset", type=name_argument, metavar="NAME",
        help=f"what it is made of; default: the scene's active grating, or without one {FIRST}",
    )  # fmt: skip
    parser.add_argument("--picture", type=name_argument, metavar="FILE", help="a picture that gives it its pattern")
    parser.add_argument(
        "--size", type=number(0.01, 2), default=0.5, metavar="X",
        help="its width over that of the mesh as the camera sees it; default 0.5",
    )  # fmt: skip
    parser.add_argument(
        "--rotation", type=number(-360, 360), default=0.0, metavar="DEGREES", help="its turn on the mesh; default 0"
    )
    add_objects(parser)
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `sticker` verb."""
    if arguments.preset:
        read_preset(arguments.preset)  # an unknown one is refused before anything is changed
    choice = Sticker(
        arguments.preset or "", arguments.picture or "", size=arguments.size, rotation=radians(arguments.rotation)
    )
    meshes, report = chosen_meshes(arguments.object), []
    for mesh in meshes:
        report += add_sticker(bpy.context, mesh, choice)
    save(arguments.save)
    print("\n".join(map(printable, report)))
