# SPDX-License-Identifier: GPL-3.0-or-later
"""Unwrapping a mesh: a UV map whose islands do not overlap, by xatlas.

xatlas can crash, and can take hours on a million faces, in which it tells nothing and hears no signal. So it works in a
process of its own (xatlas_worker.py), which is ended with this one."""

import importlib.util
import os
import subprocess
import sys
import tempfile
import time
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.failure import GratingError
from ..base.files import partial_folder, write_whole
from ..base.progress import Progress, silent

# The greatest size of a mesh's file, unpacked: some 40 million triangles.
_LARGEST = 1 << 31
# Measured on two busy cores: 4 thousand triangles in 0.5 s, 488 thousand in 600 s.
_SECONDS_PER_TRIANGLE, _GROWTH = 2.7e-6, 1.47
_POLL_SECONDS = 0.1
# Of a file of triangles: name, kind of number and columns of each array.
_ARRAYS = {"points": ("f", (3,)), "triangles": ("iu", (3,)), "polygons": ("iu", ())}


@dataclass(frozen=True)
class Mesh:
    """points     (n, 3) in metres
    triangles  (m, 3) their points
    polygons   (m,) the face to which each triangle belongs: a face stays in one piece on the map"""

    points: np.ndarray
    triangles: np.ndarray
    polygons: np.ndarray

    def __post_init__(self) -> None:
        """Raises GratingError unless it is a mesh with some area."""
        if not len(self.triangles):
            raise GratingError("the mesh: no faces to unwrap; choose a mesh with faces")
        if not np.isfinite(self.points).all():
            raise GratingError("the mesh: a point that is nowhere (not a number); delete it")
        if self.triangles.min() < 0 or self.triangles.max() >= len(self.points):
            raise GratingError("the mesh: a face of a point that is not there; write the file again")
        if not (self.areas() > 0).any():
            raise GratingError("the mesh: no face has an area; scale it up, or dissolve what is degenerate")

    def areas(self) -> np.ndarray:
        """Twice the area (m,) of each triangle."""
        first, second, third = (self.points[self.triangles[:, each]].astype(float) for each in range(3))
        return np.linalg.norm(np.cross(second - first, third - first), axis=1)


@dataclass(frozen=True)
class Packing:
    """How islands lie on the map: its side and the space between islands in pixels, and pixels per metre, 0 for as many
    as the map holds."""

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


def has_xatlas() -> bool:
    """Whether this Python has xatlas."""
    return importlib.util.find_spec("xatlas") is not None


def expected_seconds(triangles: int) -> float:
    """About how long xatlas takes for a number of triangles."""
    return 0.5 + _SECONDS_PER_TRIANGLE * triangles**_GROWTH


def unwrap(mesh: Mesh, packing: Packing, *, progress: Progress = silent) -> Unwrapped:
    """A new UV map of a mesh. Progress is the share of the expected time that is gone.

    Raises GratingError if there is no xatlas, if it crashes, or if the map is too small for the density."""
    if not has_xatlas():
        version = ".".join(map(str, sys.version_info[:2]))
        raise GratingError(f"xatlas: there is none for Python {version}; choose Blender's own Minimum Stretch")
    with partial_folder(Path(tempfile.gettempdir()), "unwrap") as folder:
        write_mesh(folder / "mesh.npz", mesh)
        _work(folder, packing, expected_seconds(len(mesh.triangles)), progress)
        with np.load(folder / "uv.npz") as found:
            return Unwrapped(found["uv"], int(found["islands"]), float(found["filled"]))


def _work(folder: Path, packing: Packing, expected: float, progress: Progress) -> None:
    """Run xatlas on a folder's mesh.npz, to its uv.npz. Whatever ends this, ends xatlas."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    numbers = (packing.size, packing.padding, packing.density)
    command = [sys.executable, "-P", "-s", "-B", "-m", f"{__package__}.xatlas_worker", str(folder), *map(str, numbers)]
    with (folder / "told.txt").open("wb") as told:
        worker = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=told, env=environment
        )
    try:
        begun = time.monotonic()
        while worker.poll() is None:
            progress("unwrap", min(0.99, (time.monotonic() - begun) / expected))
            time.sleep(_POLL_SECONDS)
    finally:
        worker.kill()
        worker.wait()
    if worker.returncode:
        lines = (folder / "told.txt").read_text(errors="replace").split("\n")
        message = next((line for line in lines if line.startswith("error: ")), "")
        crash = f"xatlas: crashed on this mesh (status {worker.returncode}); choose Blender's own Minimum Stretch"
        raise GratingError(message.removeprefix("error: ") or crash)
    progress("unwrap", 1.0)


def write_mesh(path: Path, mesh: Mesh) -> None:
    """Write a mesh's file."""
    arrays = {name: getattr(mesh, name) for name in _ARRAYS}
    write_whole(path, lambda partial: np.savez(partial, **arrays))


def read_mesh(path: Path) -> Mesh:
    """The mesh in a file. Raises GratingError, naming the file, if it holds none."""
    wanted = f"{path}: no mesh to unwrap; give an .npz with the arrays {', '.join(_ARRAYS)}"
    try:
        with zipfile.ZipFile(path) as packed:
            if sum(each.file_size for each in packed.infolist()) > _LARGEST:
                raise GratingError(f"{path}: more than 40 million triangles; give a smaller mesh")
        with np.load(path) as file:
            arrays = {name: file[name] for name in _ARRAYS}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, NotImplementedError) as error:
        raise GratingError(wanted) from error
    for name, (kinds, columns) in _ARRAYS.items():
        array = arrays[name]
        if array.dtype.kind not in kinds or array.shape[1:] != columns or array.ndim != len(columns) + 1:
            raise GratingError(wanted)
    if len(arrays["polygons"]) != len(arrays["triangles"]):
        raise GratingError(wanted)
    return Mesh(**arrays)
