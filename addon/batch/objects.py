# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects on which a verb works: those that it names, else the selected."""

import argparse

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.cli.option_types import name_argument


def add_objects(parser: argparse.ArgumentParser) -> None:
    """The option that names objects."""
    parser.add_argument(
        "--object",
        action="append",
        type=name_argument,
        metavar="NAME",
        help="a mesh (repeatable); default: the selected",
    )


def chosen_objects(names: list[str] | None) -> list[bpy.types.Object]:
    """The objects of these names, also those that the viewport hides or that cannot be selected; without names the
    selected ones. As far as Blender can, these are selected then, and no others. Raises GratingError if one is
    missing."""
    if not names:
        return [o for o in bpy.context.view_layer.objects if o.select_get()]
    objects = bpy.context.view_layer.objects
    for name in names:
        if name not in objects:
            raise GratingError(name, "no such object in the scene", f"there are {', '.join(o.name for o in objects)}")
    for candidate in objects:
        candidate.select_set(candidate.name in names)
    return [objects[name] for name in dict.fromkeys(names)]


def chosen_meshes(names: list[str] | None) -> list[bpy.types.Object]:
    """The meshes of these names, else those that are selected. Raises GratingError if there is none."""
    chosen = chosen_objects(names)
    meshes = [o for o in chosen if o.type == "MESH"]
    if not meshes:
        told = ", ".join(o.name for o in chosen) or f"scene {bpy.context.scene.name}"
        raise GratingError(told, "no mesh is selected", "name one by --object")
    return meshes
