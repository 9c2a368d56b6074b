# SPDX-License-Identifier: GPL-3.0-or-later
"""`comb`: store a smooth direction on meshes of the open file."""

import argparse

import bpy

from ...precompute.base.failure import printable
from ...precompute.cli.arguments import add_progress, name_argument
from ...precompute.cli.comb_verb import progress_of
from ..gratings.direction_source import COMB_SOURCES
from ..workflow.combing import comb_and_wait
from .chosen import add_save, chosen_objects, save

_AXES = ("x", "y", "z")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `comb`."""
    parser.add_argument(
        "--object", action="append", required=True, type=name_argument, metavar="NAME",
        help="a mesh to comb, or an object to follow: a curve, hair, an armature (repeatable)",
    )  # fmt: skip
    kinds = [name.lower() for name, _, _ in COMB_SOURCES]
    parser.add_argument(
        "--source", choices=[*(kind for kind in kinds if kind not in _AXES), "axis"], default="tail",
        help="what the direction follows; default tail: along the body, found from its shape",
    )  # fmt: skip
    parser.add_argument("--axis", choices=_AXES, default="x", help="axis of the object, for --source axis; default x")
    add_progress(parser)
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `comb` verb."""
    chosen = chosen_objects(arguments.object)
    source = arguments.axis if arguments.source == "axis" else arguments.source
    report = comb_and_wait(bpy.context.scene, chosen, source.upper(), progress=progress_of(arguments))
    save(arguments.save)
    print("\n".join(map(printable, report)))
