# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects that a verb works on: named ones, or by default the selected ones."""

import argparse

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.cli.option_types import name_argument


def add_objects(parser: argparse.ArgumentParser, default: str = "the selected meshes") -> None:
    """Add the option that names objects. `default` is what the verb takes without it, for the help."""
    parser.add_argument(
        "--object",
        action="append",
        type=name_argument,
        metavar="NAME",
        help=f"a mesh (repeatable); default: {default}",
    )


def chosen_objects(names: list[str] | None) -> list[bpy.types.Object]:
    """The objects with these names, including hidden and unselectable ones; without names, the selected objects. Named
    objects become the selection, as far as Blender allows. Raises GratingError if one is missing."""
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
    """The meshes with these names, by default the selected ones. Raises GratingError if there is none."""
    chosen = chosen_objects(names)
    meshes = [o for o in chosen if o.type == "MESH"]
    if not meshes:
        told = ", ".join(o.name for o in chosen) or f"scene {bpy.context.scene.name}"
        raise GratingError(told, "no mesh is selected", "name one by --object")
    return meshes
