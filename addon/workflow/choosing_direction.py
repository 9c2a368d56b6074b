# SPDX-License-Identifier: GPL-3.0-or-later
"""Choosing where a grating takes its direction from."""

import bpy

from ...precompute.base.failure import GratingError
from ..gratings.direction_source import FRAME_MAP, UV_MAP, DirectionSource, is_frame_map
from ..gratings.grating import Grating
from ..materials.group_users import shown_by
from ..materials.skin import set_up
from .chosen_meshes import check_frame


def choose_frame(grating: Grating, source: DirectionSource) -> str:
    """Make all materials of a grating take their direction from a source. Returns a line to report. Raises
    GratingError, with nothing changed, if the source or a mesh that shows the grating lacks what is needed, or if the
    grating's node group is linked from another file."""
    if source.kind == UV_MAP and not source.uv_map:
        raise GratingError(grating.name, "no UV map is named for its direction", "name one")
    if source.kind == FRAME_MAP and not is_frame_map(source.frame_map):
        name = "no picture" if source.frame_map is None else source.frame_map.name
        raise GratingError(grating.name, f"{name} is no direction map", "use Bake Direction Map")
    group = grating.group
    if group is not None and group.library is not None:
        raise GratingError(group.name, f"linked from {group.library.filepath}", "make it local to change its direction")
    for mesh in meshes_that_show(group):
        check_frame(mesh, source)
    grating.take_frame_source(source)
    if group is not None:
        set_up(group, frame=source)
    return f"{grating.name}: its direction is from {described(source)}"


def described(source: DirectionSource) -> str:
    """A source in a few words."""
    return {
        "STORED": "what is stored on the mesh, else its UV map",
        "UV_MAP": f"the UV map {source.uv_map}",
        "RADIAL": f"away from the object's {source.axis} axis",
        "AXIS": f"the object's {source.axis} axis",
        "FRAME_MAP": f"the direction map {source.frame_map.name if source.frame_map else ''}",
    }[source.kind]


def meshes_that_show(group: bpy.types.NodeTree | None) -> list[bpy.types.Object]:
    """The file's mesh objects that have a Diffraction group in their materials."""
    return [thing for thing in shown_by(group) if thing.type == "MESH"]
