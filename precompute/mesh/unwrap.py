# SPDX-License-Identifier: GPL-3.0-or-later
"""Unwraps a mesh with xatlas: a UV map whose islands do not overlap.

xatlas can crash. A million faces can take it hours, without progress reports or a reaction to signals. So it runs in a
child process (xatlas_worker.py), which ends with this process or at a deadline."""

import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.child_process import PYTHON_FLAGS, ChildProcess, lines_of
from ..base.failure import GratingError
from ..base.files import write_whole
from ..base.machine import missing_packages
from ..base.progress import Progress, silent
from ..base.strict import failure_in
from .surface import FARTHEST_M, read_arrays

# What to do without xatlas.
BY_BLENDER = "choose Blender's own Minimum Stretch"
# Fitted to timings on two busy cores: 4 thousand triangles in 0.5 s, 488 thousand in 600 s.
_SECONDS_PER_TRIANGLE, _GROWTH = 2.7e-6, 1.47
# The deadline: this many times the expected time, plus this many seconds.
_PATIENCE, _LEAST_PATIENCE_SECONDS = 20, 30
_POLL_SECONDS = 0.1
# The files that this process and the child process exchange.
_MESH, _MAP = "mesh.npz", "uv.npz"
# The arrays of a mesh's file.
_ARRAYS = {"points": ("f", (None, 3)), "triangles": ("iu", (None, 3)), "polygons": ("iu", (None,))}


@dataclass(frozen=True)
class Mesh:
    """points     (n, 3) in metres
    triangles  (m, 3) their points
    polygons   (m,) the face of each triangle; a face stays in one piece on the map"""

    points: np.ndarray
    triangles: np.ndarray
    polygons: np.ndarray

    def __post_init__(self) -> None:
        """Raises GratingError unless the mesh is valid and has some area."""
        if not len(self.triangles):
            raise GratingError("the mesh", "no faces to unwrap", "choose a mesh with faces")
        if not np.isfinite(self.points).all():
            raise GratingError("the mesh", "a point has no position (NaN)", "delete it")
        if len(self.points) and np.abs(self.points).max() > FARTHEST_M:
            raise GratingError(
                "the mesh", f"a point more than {FARTHEST_M / 1e3:g} km away", "delete it, or scale it down"
            )
        if self.triangles.min() < 0 or self.triangles.max() >= len(self.points):
            raise GratingError("the mesh", "a face has a point that does not exist", "write the file again")
        if not (self.areas() > 0).any():
            raise GratingError("the mesh", "no face has an area", "scale it up, or dissolve degenerate faces")

    def areas(self) -> np.ndarray:
        """Twice the area (m,) of each triangle."""
        first, second, third = (self.points[self.triangles[:, each]].astype(float) for each in range(3))
        return np.linalg.norm(np.cross(second - first, third - first), axis=1)


@dataclass(frozen=True)
class Packing:
    """The packing of islands: the map's side and the islands' distance in pixels, and pixels per metre (0: the
    most)."""

    size: int = 1024
    padding: int = 4
    density: float = 0.0


@dataclass(frozen=True)
class Unwrapped:
    """uv       (m, 3, 2) of each triangle's corners, from 0 to 1
    islands  their number
    filled   the share of the map that they fill"""

    uv: np.ndarray
    islands: int
    filled: float


def expected_seconds(triangles: int) -> float:
    """Estimate the time of xatlas for a number of triangles."""
    return 0.5 + _SECONDS_PER_TRIANGLE * triangles**_GROWTH


def longest_seconds(triangles: int) -> float:
    """The time after which xatlas is ended, for a number of triangles."""
    return _LEAST_PATIENCE_SECONDS + _PATIENCE * expected_seconds(triangles)


def unwrap(mesh: Mesh, packing: Packing, *, progress: Progress = silent) -> Unwrapped:
    """Unwrap a mesh. Progress is the share of the expected time that has passed.

    Raises GratingError if xatlas is missing or crashes, or if the map is too small for the density."""
    if "xatlas" in missing_packages():
        version = ".".join(map(str, sys.version_info[:2]))
        raise GratingError("xatlas", f"it is not installed for Python {version}", BY_BLENDER)
    worker = _started(mesh, packing)
    try:
        _wait(worker, expected_seconds(len(mesh.triangles)), progress)
        with np.load(worker.folder / _MAP) as found:
            return Unwrapped(found["uv"], int(found["islands"]), float(found["filled"]))
    finally:
        worker.cancel()


def _started(mesh: Mesh, packing: Packing) -> ChildProcess:
    """Start xatlas on a mesh in a child process."""
    numbers = (packing.size, packing.padding, packing.density)

    def prepare(folder: Path) -> list[str]:
        write_mesh(folder / _MESH, mesh)
        worker = f"{__package__}.xatlas_worker"
        return [
            sys.executable,
            *PYTHON_FLAGS,
            "-m",
            worker,
            str(folder / _MESH),
            str(folder / _MAP),
            *map(str, numbers),
        ]

    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return ChildProcess(prepare, environment, longest_seconds=longest_seconds(len(mesh.triangles)))


def _wait(worker: ChildProcess, expected: float, progress: Progress) -> None:
    """Wait until xatlas has written its map. Raises GratingError if xatlas fails or is late."""
    begun = time.monotonic()
    while worker.running:
        progress("unwrap", min(0.99, (time.monotonic() - begun) / expected))
        time.sleep(_POLL_SECONDS)
    if worker.is_late:
        raise GratingError("xatlas", f"no map of this mesh after {time.monotonic() - begun:.0f} s", BY_BLENDER)
    if worker.status:
        crash = GratingError("xatlas", f"crashed on this mesh (status {worker.status})", BY_BLENDER)
        raise failure_in(lines_of(worker.err_path)) or crash
    progress("unwrap", 1.0)


def write_mesh(path: Path, mesh: Mesh) -> None:
    """Write a mesh's file."""
    arrays = {name: getattr(mesh, name) for name in _ARRAYS}
    write_whole(path, lambda partial: np.savez(partial, **arrays))


def read_mesh(path: Path) -> Mesh:
    """Read the mesh in a file. Raises GratingError, with the file's name, if the file holds no mesh."""
    try:
        arrays = read_arrays(path, _ARRAYS)
        if missing := [name for name in _ARRAYS if name not in arrays]:
            raise ValueError(f"{missing[0]} is missing")
        if len(arrays["polygons"]) != len(arrays["triangles"]):
            raise ValueError("polygons and triangles are of different lengths")
    except (OSError, ValueError) as error:
        fault = getattr(error, "strerror", None) or error
        raise GratingError(
            path, f"no mesh to unwrap ({fault})", f"give an .npz with the arrays {', '.join(_ARRAYS)}"
        ) from error
    return Mesh(**arrays)
