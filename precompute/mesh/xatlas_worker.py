# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs xatlas on a mesh's file: `python -m precompute.mesh.xatlas_worker MESH.npz UV.npz SIZE PADDING DENSITY`.

This is the child process of unwrap.py, because xatlas may crash."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from ..base.failure import GratingError
from ..base.machine import bundled
from ..base.strict import failure_line
from .unwrap import BY_BLENDER, Mesh, Packing, Unwrapped, read_mesh

if TYPE_CHECKING:
    import xatlas

# Two triangles of a face agree on a corner's place if they differ by less than this share of the map.
_SAME = 1e-6


def unwrapped(mesh: Mesh, packing: Packing) -> Unwrapped:
    """Unwrap a mesh. Raises GratingError if the map is too small for the density."""
    charts = _xatlas().Atlas()
    charts.add_mesh(mesh.points.astype(np.float32), mesh.triangles.astype(np.uint32))
    charts.generate(_cut(), _options(packing))
    uv = _corners(charts)
    torn = _torn(mesh, uv)
    if not torn.any():
        return _checked(charts, uv)
    # xatlas knows only triangles and may cut a face in two. Cut faces become islands, and all are packed again.
    whole = uv * (charts.width, charts.height) / charts.texels_per_unit  # metres
    whole[torn] = _laid_out(mesh, torn) + (whole.max() + 1.0, 0.0)
    packed = _xatlas().Atlas()
    corners = np.arange(3 * len(whole), dtype=np.uint32).reshape(-1, 3)
    packed.add_uv_mesh(whole.reshape(-1, 2).astype(np.float32), corners)
    packed.generate(_cut(), _options(packing))
    return _checked(packed, _corners(packed))


def _xatlas() -> ModuleType:
    return bundled("xatlas", BY_BLENDER)


def _cut() -> xatlas.ChartOptions:
    options = _xatlas().ChartOptions()
    options.fix_winding = True  # otherwise islands may be mirrored
    return options


def _options(packing: Packing) -> xatlas.PackOptions:
    options = _xatlas().PackOptions()
    options.resolution, options.padding = packing.size, packing.padding
    options.texels_per_unit = packing.density
    # xatlas rotates by exchanging u and v, which mirrors the island.
    options.rotate_charts = False
    return options


def _corners(atlas: xatlas.Atlas) -> np.ndarray:
    """The UV (m, 3, 2) of each triangle's corners."""
    _, corners, uv = atlas.get_mesh(0)
    return uv[corners].astype(float)


def _checked(atlas: xatlas.Atlas, uv: np.ndarray) -> Unwrapped:
    if atlas.atlas_count != 1:
        raise GratingError(
            "the map",
            f"{atlas.atlas_count} maps of this size are needed for this density",
            "ask for a larger map, or fewer pixels per metre",
        )
    return Unwrapped(uv.astype(np.float32), atlas.chart_count, float(atlas.utilization))


def _torn(mesh: Mesh, uv: np.ndarray) -> np.ndarray:
    """Which triangles (m,) belong to faces whose triangles disagree on the UV of a common point."""
    keys = mesh.polygons[:, None].astype(np.int64) * len(mesh.points) + mesh.triangles
    order = np.argsort(keys, axis=None, kind="stable")
    keys, places = keys.ravel()[order], uv.reshape(-1, 2)[order]
    apart = (keys[1:] == keys[:-1]) & (np.abs(places[1:] - places[:-1]).max(axis=1) > _SAME)
    return np.isin(mesh.polygons, keys[1:][apart] // len(mesh.points))


def _laid_out(mesh: Mesh, torn: np.ndarray) -> np.ndarray:
    """Lay out torn triangles: their corners (k, 3, 2) in metres, each face on a plane in a cell of a square grid.

    The plane's normal is the sum of the triangles' unit normals. On this plane the two triangles of a bent quad never
    fold over each other; on the mean plane they can."""
    _, face = np.unique(mesh.polygons[torn], return_inverse=True)
    ends = mesh.points[mesh.triangles[torn]].astype(float)
    count = face.max() + 1
    normal = np.zeros((count, 3))
    np.add.at(normal, face, _unit(np.cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0])))
    normal = _unit(normal)
    # Any direction perpendicular to the normal works; it is derived from the axis that is most perpendicular.
    across = np.eye(3)[np.abs(normal).argmin(axis=1)]
    along = _unit(np.cross(across, normal))
    axes = np.stack([along, np.cross(normal, along)], axis=1)[face]
    flat = np.einsum("kax,kcx->kca", axes, ends)
    low = np.full((count, 2), np.inf)
    np.minimum.at(low, face, flat.min(axis=1))
    flat -= low[face, None]
    side = int(np.ceil(np.sqrt(count)))
    cell = np.stack([face % side, face // side], axis=1) * (1.1 * flat.max())
    return flat + cell[:, None]


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Scale vectors to length 1; zero stays zero."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)


def main(arguments: list[str]) -> None:
    mesh, target, size, padding, density = arguments
    found = unwrapped(read_mesh(Path(mesh)), Packing(int(size), int(padding), float(density)))
    np.savez(target, uv=found.uv, islands=found.islands, filled=found.filled)


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except GratingError as error:
        sys.exit(failure_line(error))
