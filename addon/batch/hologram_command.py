# SPDX-License-Identifier: GPL-3.0-or-later
"""`hologram`: give the gratings on meshes of the open file a hologram's pattern."""

import argparse

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.cli.arguments import name_argument
from ..materials.holograms.patterns import NONE, OWN_INPUTS, PATTERNS, PICTURE
from ..workflow.varying_inputs import Hologram, add_hologram
from .chosen import add_objects, add_save, chosen_meshes, save, setting


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `hologram`."""
    names = [name.lower().replace("_", "-") for name, _, _ in PATTERNS]
    parser.add_argument("pattern", choices=names, metavar="PATTERN", help=f"one of {', '.join(names)}")
    add_objects(parser)
    parser.add_argument("--picture", type=name_argument, metavar="FILE", help="the picture of the pattern picture")
    parser.add_argument(
        "--uv-map", type=name_argument, metavar="NAME", help="UV map of the pattern; default: the one that renders"
    )
    inputs = "; ".join(f"{name.lower()}: {', '.join(each.name for each in own)}" for name, own in OWN_INPUTS.items())
    parser.add_argument(
        "--set", action="append", type=name_argument, metavar="NAME=VALUE",
        help=f"set an input of the pattern, angles in degrees (repeatable). {inputs}",
    )  # fmt: skip
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `hologram` verb."""
    pattern = arguments.pattern.upper().replace("-", "_")
    if arguments.picture and pattern != PICTURE:
        raise GratingError("--picture", f"{arguments.pattern} reads no picture", "leave it out, or choose picture")
    if arguments.set and pattern == NONE:
        raise GratingError("--set", f"{arguments.pattern} has no inputs", "leave it out")
    inputs = {socket.name: socket for socket in OWN_INPUTS.get(pattern, ())}
    values = dict(setting(text, inputs) for text in arguments.set or ())
    choice = Hologram(pattern, values, picture=arguments.picture or "", uv_map=arguments.uv_map or "")
    report = add_hologram(bpy.context.scene, chosen_meshes(arguments.object), choice)
    save(arguments.save)
    print("\n".join(map(printable, report)))
