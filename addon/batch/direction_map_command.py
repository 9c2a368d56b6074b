# SPDX-License-Identifier: GPL-3.0-or-later
"""`direction-map`: bake the direction of a mesh's grating into a picture."""

import argparse

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.cli.arguments import add_json, count, name_argument, path_argument
from ...precompute.cli.printing import emit
from ..workflow.combing import bake_direction_map
from .chosen import add_objects, add_save, chosen_meshes, save


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `direction-map`."""
    add_objects(parser)
    parser.add_argument(
        "--uv-map", type=name_argument, metavar="NAME", help="UV map to bake onto; default: the active one"
    )
    parser.add_argument(
        "--size", type=count(16, 1 << 14), default=1024, metavar="PIXELS", help="side of the picture; default 1024"
    )
    parser.add_argument(
        "--margin", type=count(2, 64), default=8, metavar="PIXELS", help="bleed past UV islands; default 8"
    )
    parser.add_argument(
        "-o", "--output", type=path_argument, metavar="EXR", help="also save the picture here; it is always packed"
    )
    parser.add_argument("--keep-source", action="store_true", help="do not make the grating use the picture")
    add_json(parser)
    add_save(parser)
    parser.set_defaults(output_is_file=True)


def run(arguments: argparse.Namespace) -> None:
    """The `direction-map` verb."""
    meshes = chosen_meshes(arguments.object)
    if len(meshes) > 1:
        raise GratingError(
            ", ".join(o.name for o in meshes), "a direction map belongs to one mesh", "name one by --object"
        )
    if meshes[0].modifiers and not meshes[0].visible_get():
        raise GratingError(meshes[0].name, "hidden in the viewport, where its modifiers do nothing", "show it")
    lines = bake_direction_map(
        bpy.context, meshes[0], uv_map=arguments.uv_map or "", size=arguments.size, margin=arguments.margin,
        path=arguments.output, read=not arguments.keep_source,
    )  # fmt: skip
    save(arguments.save)
    emit({"report": lines}, arguments.json, lambda: map(printable, lines))
