# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh to comb and a combed one as files, by which Blender and the process beside it speak: NumPy's .npz."""

import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..base.failure import GratingError
from ..base.files import write_whole
from .comb import GUIDES, Combed
from .layout import Polygons

_MESH = ("points", "point", "normals", "corners", "face")
_COMBED = ("uv", "turn", "triangle", "index", "residual")


def write_mesh(path: Path, polygons: Polygons, request: Mapping[str, np.ndarray]) -> None:
    """Write a mesh and how it is to be combed. Raises GratingError if it cannot be written."""
    arrays = {name: getattr(polygons, name) for name in _MESH}
    write_whole(path, lambda partial: np.savez(partial, **arrays, **request))


def read_mesh(path: Path) -> tuple[Polygons, dict[str, np.ndarray]]:
    """A mesh and how it is to be combed. Raises GratingError, naming the file, if they are not in it."""
    arrays = _arrays(path)
    needed = GUIDES.get(str(arrays.get("guide")))
    if "guide" not in arrays or str(arrays["guide"]) not in GUIDES or (needed and needed not in arrays):
        raise GratingError(f"{path}: tells of no guide for a comb; let Comb Grating write it")
    if any(name not in arrays for name in _MESH):
        raise GratingError(f"{path}: holds no mesh; let Comb Grating write it")
    polygons = Polygons(*(arrays.pop(name) for name in _MESH))
    corners = len(polygons.point)
    shapes = (polygons.points.shape[1:], polygons.normals.shape, polygons.corners.shape[1:], polygons.face.shape)
    fits = shapes == ((3,), (corners, 3), (3,), (len(polygons.corners),))
    inside = fits and _below(polygons.point, len(polygons.points)) and _below(polygons.corners, corners)
    if not inside or not _below(polygons.face, max(1, corners)):
        raise GratingError(f"{path}: its mesh contradicts itself; let Comb Grating write it anew")
    return polygons, arrays


def write_combed(path: Path, combed: Combed) -> None:
    """Write a combed mesh. Raises GratingError if it cannot be written."""
    write_whole(path, lambda partial: np.savez(partial, **{name: getattr(combed, name) for name in _COMBED}))


def read_combed(path: Path) -> dict[str, np.ndarray]:
    """The arrays of a combed mesh, as Combed has them, without its directions. Raises GratingError if it is none."""
    arrays = _arrays(path)
    if any(name not in arrays for name in _COMBED):
        raise GratingError(f"{path}: no combed mesh; comb it anew")
    return arrays


def _below(numbers: np.ndarray, limit: int) -> bool:
    """Whether all are whole numbers from 0 to less than a limit."""
    return numbers.dtype.kind in "iu" and (not numbers.size or (numbers.min() >= 0 and numbers.max() < limit))


def _arrays(path: Path) -> dict[str, np.ndarray]:
    try:
        with np.load(path) as held:
            return {name: held[name] for name in held.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, AttributeError) as error:
        raise GratingError(f"{path}: cannot be read as a mesh; let Comb Grating write it") from error
