# SPDX-License-Identifier: GPL-3.0-or-later
"""Combs a mesh: a smooth direction field that follows a guide, stored in a form that Blender can carry."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..base.failure import GratingError
from ..base.progress import Progress, silent, span_of
from . import guide
from .direction_field import guided_field, singular_triangles, smoothest_field
from .guide import head_to_tail
from .layout import Polygons, corner_directions, lay, uv_directions
from .surface import FARTHEST_M, Surface, surface_of

# The guides of a comb, and the array that each needs: a direction (3,), UV (corners, 2), or segments (k, 2, 3). "copy"
# takes U's direction unchanged, with all its turns.
GUIDES = {
    "axis": "axis", "uv": "uv", "copy": "uv", "bones": "segments", "strokes": "segments", "tail": None,
    "smoothest": None,
}  # fmt: skip

# The greatest total length of strokes or bones, in mean edge lengths. A stroke is cut into pieces of half an edge.
_LONGEST_STROKES = 1e6


@dataclass(frozen=True)
class Combed:
    """A combed mesh.

    directions  (corners, 3) the field at the corners of the faces, perpendicular to their shading normals
    uv          (corners, 2) the UV map whose U follows the field
    turn        (corners, 3) the angle from U to the field: cosine, sine and 0
    triangle    (s,) the singular triangles
    index       (s,) how often the field turns around each; 0 where it flips because the guide contradicts itself
    residual    relative residual of the linear system"""

    directions: np.ndarray
    uv: np.ndarray
    turn: np.ndarray
    triangle: np.ndarray
    index: np.ndarray
    residual: float


def comb(name: str, polygons: Polygons, request: Mapping[str, np.ndarray], *, progress: Progress = silent) -> Combed:
    """Comb a mesh. The request holds `guide`, one of GUIDES, and the array that this guide needs.

    Raises GratingError, with the mesh's name, if no face has an area or the guide has nothing to follow."""
    if not len(polygons.corners):
        raise GratingError(name, "no faces to comb", "choose a mesh with faces")
    if not np.isfinite(polygons.points).all():
        raise GratingError(name, "points that are not numbers", "use Mesh > Clean Up > Delete Loose, or make it again")
    if np.abs(polygons.points).max() > FARTHEST_M:
        raise GratingError(name, f"points more than {FARTHEST_M / 1e3:g} km away", "delete them, or scale it down")
    surface = surface_of(polygons.points, polygons.triangles)
    if not len(surface.triangles):
        raise GratingError(name, "its faces have no area", "scale it up, or choose another mesh")
    progress("combing", 0.1)
    kind = str(request["guide"])
    if kind == "copy":
        directions = uv_directions(polygons, request["uv"])
        uv, turn = lay(polygons, directions)
        progress("combing", 1.0)
        return Combed(directions, uv, turn, triangle=np.zeros(0, int), index=np.zeros(0, int), residual=0.0)
    if kind == "smoothest":
        field = smoothest_field(surface, progress=span_of(progress, 0.1, 0.9))
    else:
        pull = _pull(name, polygons, surface, request=request, progress=span_of(progress, 0.1, 0.4))
        field = guided_field(surface, guide.where_bare(surface, pull), progress=span_of(progress, 0.4, 0.9))
    singular = singular_triangles(surface, field.direction)
    directions = corner_directions(polygons, surface, field.direction)
    uv, turn = lay(polygons, directions)
    progress("combing", 1.0)
    there = np.flatnonzero((singular.index != 0) | singular.torn)
    return Combed(directions, uv, turn, surface.kept[there], singular.index[there], field.residual)


def _pull(
    name: str, polygons: Polygons, surface: Surface, *, request: Mapping[str, np.ndarray], progress: Progress
) -> np.ndarray:
    """The guide's pull (nodes,). Raises GratingError if there is nothing to follow."""
    kind = str(request["guide"])
    if kind == "tail":
        return head_to_tail(surface, progress=progress)
    if kind == "axis":
        return guide.along_axis(surface, request["axis"])
    if kind == "uv":
        return guide.along_uv(surface, request["uv"][polygons.corners[surface.kept]])
    segments = np.asarray(request["segments"], float).reshape(-1, 2, 3)
    segments = segments[np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1) > 0]
    if not len(segments):
        what = "bones" if kind == "bones" else "strokes"
        raise GratingError(name, f"no {what} to follow", "draw some along the body, or choose another source")
    if np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum() > _LONGEST_STROKES * surface.length:
        raise GratingError(name, "strokes or bones of more than a million edges' length", "draw shorter ones")
    return (guide.along_bones if kind == "bones" else guide.along_strokes)(surface, segments)
