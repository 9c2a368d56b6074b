# SPDX-License-Identifier: GPL-3.0-or-later
"""`lights`: choose the lights that gratings of the open file respond to."""

import argparse

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.cli.arguments import name_argument
from ..gratings.grating import LIGHTS
from ..workflow.lights.lighting import keep_lamp
from ..workflow.making_materials import choose_lights
from .chosen import add_gratings, add_save, chosen_gratings, save


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `lights`."""
    names = [name.lower() for name, _, _ in LIGHTS]
    parser.add_argument(
        "lights", nargs="?", choices=names, metavar="LIGHTS",
        help="rest: lamps without noise, other light by random samples; lamps: only lamps; all: every light by random "
        "samples, exact but noisy. Default: as it is",
    )  # fmt: skip
    add_gratings(parser)
    parser.add_argument("--shadows", choices=("on", "off"), help="whether objects cast shadows on the diffraction")
    parser.add_argument(
        "--leave-out", action="append", type=name_argument, metavar="LAMP",
        help="the lamp does not light the diffraction; it still lights everything else (repeatable)",
    )  # fmt: skip
    parser.add_argument(
        "--keep-in", action="append", type=name_argument, metavar="LAMP",
        help="the lamp lights the diffraction (repeatable)",
    )  # fmt: skip
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `lights` verb."""
    scene = bpy.context.scene
    if not (arguments.lights or arguments.shadows or arguments.leave_out or arguments.keep_in):
        raise GratingError("", "nothing to change is given", "name the lights, or give --shadows or --leave-out")
    gratings = chosen_gratings(scene, arguments)
    lines = []
    for names, counts in ((arguments.leave_out, False), (arguments.keep_in, True)):
        for name in names or ():
            lines += keep_lamp(scene, name, counts=counts)
    for grating in gratings:
        if arguments.shadows:
            grating.shadows = arguments.shadows == "on"
        lines += choose_lights(grating, arguments.lights.upper() if arguments.lights else grating.lights)
    save(arguments.save)
    print("\n".join(map(printable, lines)))
