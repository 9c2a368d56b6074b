# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that Blender and the process beside it exchange: a mesh to comb and a combed mesh, as NumPy's .npz."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..base.failure import GratingError
from ..base.files import write_whole
from .comb import GUIDES, Combed
from .layout import Polygons
from .surface import FARTHEST_M, Wanted, read_arrays

_MESH: dict[str, Wanted] = {
    "points": ("f", (None, 3)), "point": ("iu", (None,)), "normals": ("f", (None, 3)), "corners": ("iu", (None, 3)),
    "face": ("iu", (None,)),
}  # fmt: skip
_REQUEST: dict[str, Wanted] = {
    "guide": ("U", ()), "name": ("U", ()), "axis": ("f", (3,)), "uv": ("f", (None, 2)), "segments": ("f", (None, 2, 3)),
}  # fmt: skip
_COMBED: dict[str, Wanted] = {
    "uv": ("f", (None, 2)), "turn": ("f", (None, 3)), "triangle": ("iu", (None,)), "index": ("iuf", (None,)),
    "residual": ("f", ()),
}  # fmt: skip
_REMEDY = "let Comb Grating write it"


def write_mesh(path: Path, polygons: Polygons, request: Mapping[str, np.ndarray]) -> None:
    """Write a mesh and its request for a comb. Raises GratingError if the file cannot be written."""
    arrays = {name: getattr(polygons, name) for name in _MESH}
    write_whole(path, lambda partial: np.savez(partial, **arrays, **request))  # type: ignore[arg-type]  # none is named allow_pickle


def read_mesh(path: Path) -> tuple[Polygons, dict[str, np.ndarray]]:
    """Read a mesh and its request for a comb. Raises GratingError, with the file's name, if either is invalid."""
    arrays = _arrays(path, _MESH | _REQUEST, _REMEDY)
    needed = GUIDES.get(str(arrays.get("guide")))
    if "guide" not in arrays or str(arrays["guide"]) not in GUIDES or (needed and needed not in arrays):
        raise GratingError(path, "does not name a guide for a comb", _REMEDY)
    if any(name not in arrays for name in _MESH):
        raise GratingError(path, "holds no mesh", _REMEDY)
    polygons = Polygons(*(arrays.pop(name) for name in _MESH))
    corners = len(polygons.point)
    fits = (len(polygons.normals), len(polygons.face)) == (corners, len(polygons.corners))
    uv_fits = len(arrays.get("uv", polygons.normals)) == corners
    inside = fits and uv_fits and _below(polygons.point, len(polygons.points)) and _below(polygons.corners, corners)
    if not inside or not _below(polygons.face, max(1, corners)):
        raise GratingError(path, "its mesh is inconsistent", "let Comb Grating write it again")
    for name, array in {"normals": polygons.normals, **arrays}.items():
        if array.dtype.kind == "f" and array.size and not np.abs(array).max() <= FARTHEST_M:
            raise GratingError(path, f"its {name} hold values that are not numbers or are too large", _REMEDY)
    return polygons, arrays


def write_combed(path: Path, combed: Combed) -> None:
    """Write a combed mesh. Raises GratingError if the file cannot be written."""
    write_whole(path, lambda partial: np.savez(partial, **{name: getattr(combed, name) for name in _COMBED}))


def read_combed(path: Path) -> dict[str, np.ndarray]:
    """Read the arrays of Combed except `directions`. Raises GratingError if the file holds no combed mesh."""
    arrays = _arrays(path, _COMBED, "comb it again")
    if any(name not in arrays for name in _COMBED):
        raise GratingError(path, "not a combed mesh", "comb it again")
    return arrays


def _below(numbers: np.ndarray, limit: int) -> bool:
    """Whether all are integers from 0 to below a limit."""
    return numbers.dtype.kind in "iu" and (not numbers.size or (numbers.min() >= 0 and numbers.max() < limit))


def _arrays(path: Path, wanted: Mapping[str, Wanted], remedy: str) -> dict[str, np.ndarray]:
    try:
        return read_arrays(path, wanted)
    except (OSError, ValueError) as error:
        fault = getattr(error, "strerror", None) or error
        raise GratingError(path, f"cannot be read as a mesh ({fault})", remedy) from error
