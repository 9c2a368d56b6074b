# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks whether the grating has a direction on the meshes that show it."""

from collections.abc import Iterator

import bpy
import numpy as np

from ..direction.tangents_at_points import frame_field
from ..direction.uv_maps import has_uv_map
from ..gratings.direction_source import AXIS, FRAME_MAP, RADIAL, DirectionSource
from ..materials.group_properties import frame_of
from .cause import Button, Cause
from .subject import Subject

# Triangles of a mesh whose direction is looked at, and the share without one that gives a warning.
_TRIANGLES, _LACKING = 500, 0.5
_AXES = ("X", "Y", "Z")


def lacking_direction(
    subject: Subject, things: list[bpy.types.Object], depsgraph: bpy.types.Depsgraph
) -> Iterator[Cause]:
    """Meshes, of the given ones, on which the source of the direction gives none: no UV map, one without area, an axis
    along the normal."""
    source = frame_of(subject.group)
    if subject.grating.frame_kind == FRAME_MAP and source.kind != FRAME_MAP:
        told = f"The direction map of {subject.grating.name} was deleted, so its UV map is used instead."
        follow = Button("grating.direction", "Follow the UV Map", {"kind": "STORED"})
        yield Cause("DIRECTION_MAP", told, follow)
    for thing in things:
        if thing.data.is_editmode:
            continue
        mesh = thing.evaluated_get(depsgraph).data
        if fault := _fault(mesh, source):
            yield Cause("DIRECTION", f"{thing.name} {fault}, so the grating has no direction there.", _by_axis(mesh))


def _fault(mesh: bpy.types.Mesh, source: DirectionSource) -> str:
    """Why a source gives a mesh no direction, in a few words; empty if it gives one."""
    if not mesh.polygons:
        return ""
    if not has_uv_map(mesh, source):
        return " ".join(filter(None, ("has no UV map", source.named_uv_map)))
    if _lacking_share(mesh, source) < _LACKING:
        return ""
    if source.kind == AXIS:
        return f"faces along its {source.axis} axis, which the direction follows"
    if source.kind == RADIAL:
        return f"faces away from its {source.axis} axis, as the direction does"
    return "has a UV map without area"


def _lacking_share(mesh: bpy.types.Mesh, source: DirectionSource) -> float:
    """The share of a mesh's triangles, evenly chosen, at whose centres a source gives no direction."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    chosen = np.unique(np.linspace(0, count - 1, min(count, _TRIANGLES)).astype(int))
    tangents = frame_field(mesh, chosen, shares=np.full((len(chosen), 3), 1 / 3), source=source).tangents
    return float((~np.isfinite(tangents).all(axis=1)).mean())


def _by_axis(mesh: bpy.types.Mesh) -> Button:
    """The button that makes the direction follow the axis that serves most faces of a mesh."""
    shares = {axis: _lacking_share(mesh, DirectionSource(AXIS, axis=axis)) for axis in _AXES}
    axis = min(_AXES, key=lambda each: shares[each])
    return Button("grating.direction", f"Follow the Object's {axis} Axis", {"kind": AXIS, "axis": axis})
