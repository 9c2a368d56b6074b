# SPDX-License-Identifier: GPL-3.0-or-later
"""`unwrap`: give meshes of the open file a UV map without overlaps."""

import argparse

import bpy

from ...precompute.base.failure import printable
from ...precompute.cli.arguments import add_json, add_progress
from ...precompute.cli.printing import Progress, emit
from ...precompute.cli.unwrap_verb import add_packing
from ...precompute.mesh.unwrap import Packing
from ..workflow.unwrapping import unwrap_and_wait, unwrap_by_blender
from .chosen import add_objects, add_save, chosen_meshes, save


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `unwrap`."""
    add_objects(parser)
    parser.add_argument(
        "--method", choices=("xatlas", "minimum-stretch"), default="xatlas",
        help="minimum-stretch is Blender's own method, along the mesh's seams; default xatlas",
    )  # fmt: skip
    add_packing(parser)
    add_json(parser)
    add_progress(parser)
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `unwrap` verb. It saves only if all meshes are unwrapped."""
    packing = Packing(arguments.size, arguments.padding, arguments.density)
    lines, progress = [], Progress(arguments.progress)
    meshes = {mesh.data: mesh for mesh in chosen_meshes(arguments.object)}  # linked duplicates share a mesh
    for mesh in meshes.values():
        if arguments.method == "xatlas":
            lines += unwrap_and_wait(mesh, packing, progress=progress)
        else:
            lines += unwrap_by_blender(bpy.context, mesh, packing)
    save(arguments.save)
    emit({"report": lines}, arguments.json, lambda: map(printable, lines))
