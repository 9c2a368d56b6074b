# SPDX-License-Identifier: GPL-3.0-or-later
"""A look at a world by a Blender of its own, beside this one.

A render in this Blender would replace the artist's Render Result, and the interface would stand still. So a copy of the
world goes into a file, and a second Blender without the artist's settings renders that: a panorama, and closer looks
where it has small bright parts (inside.py).
"""

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from ...precompute.base.files import told_of
from ...precompute.base.job import JOB_VARIABLE, LOCK
from ...precompute.base.locks import try_lock
from ...precompute.base.strict_json import read_json
from ...precompute.lights.sources import Source
from .stand_alone import is_even, stand_alone

_START = Path(__file__).with_name("start.py")
# A world whose pictures take longer to load is a fault: of 16384 x 8192 pixels it takes seconds.
_LONGEST_SECONDS = 300
_GRACE_SECONDS = 5


@dataclass(frozen=True)
class Fit:
    """What a probe found.

    panorama    (rows, cols, 3) the world's radiance, as precompute/lights/panorama.py lays it
    sources     the brightest first
    missed      the share of the light that is bright and compact but in no source, 0 to 1"""

    panorama: np.ndarray
    sources: list[Source]
    missed: float


class Probe:
    """A running look at a world. Poll `running`, or `wait`; then take the `result`.

    Blender holds a lock in the probe's private folder: where it ends without a word, the second Blender ends too."""

    def __init__(self, world: bpy.types.World, scene: bpy.types.Scene, count: int) -> None:
        """Start to look for at most `count` sources. Raises GratingError while a render is running, which reads the
        data that the copy of the world would change, and where no file can be written."""
        if _is_rendering():
            raise GratingError(f"world {world.name}: not fitted while a render is running; try again when it has ended")
        self._name = world.name
        with told_of(Path(tempfile.gettempdir())):
            self._private = tempfile.TemporaryDirectory(prefix="natural-gratings-", ignore_cleanup_errors=True)
            private = self._folder = Path(self._private.name)
            self._lock = try_lock(private / LOCK)
            _write_request(world, scene, {"folder": str(private), "count": count})
            inherited = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
            with (private / "told.txt").open("wb") as told:
                self._process = subprocess.Popen(
                    [*_blender(), str(private / "request.json")], stdin=subprocess.DEVNULL, stdout=told, stderr=told,
                    env=inherited | {JOB_VARIABLE: str(private)},
                )  # fmt: skip

    @property
    def running(self) -> bool:
        """Whether the second Blender has not ended yet."""
        return self._process.poll() is None

    def wait(self) -> None:
        """Return when it has ended. It is stopped where the wait is interrupted or takes beyond reason."""
        try:
            self._process.wait(_LONGEST_SECONDS)
        except subprocess.TimeoutExpired as error:
            self.cancel()
            raise GratingError(
                f"world {self._name}: not rendered within {_LONGEST_SECONDS} s; use smaller pictures in it"
            ) from error
        except BaseException:
            self.cancel()
            raise

    def result(self) -> Fit:
        """What was found, once it has ended. Raises GratingError if the second Blender failed."""
        try:
            if self._process.returncode == 0:
                found = read_json(self._folder / "fit.json", "try again")
                sources = [
                    Source(np.array(one["direction"]), np.array(one["irradiance"]), one["variance"])
                    for one in found["sources"]
                ]
                return Fit(np.load(self._folder / "panorama.npy"), sources, found["missed"])
            told = (self._folder / "told.txt").read_text(encoding="utf-8", errors="replace").splitlines()
        finally:
            self._clean_up()
        last = next((line for line in reversed(told) if line.strip()), "no word")
        raise GratingError(f"world {self._name}: not rendered ({last}); look at its nodes and pictures")

    def cancel(self) -> None:
        """Stop the second Blender and remove what it has written."""
        self._process.terminate()
        try:
            self._process.wait(_GRACE_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._clean_up()

    def _clean_up(self) -> None:
        self._lock.close()
        self._private.cleanup()


def panorama(world: bpy.types.World, scene: bpy.types.Scene) -> np.ndarray:
    """The world's radiance (rows, cols, 3) as glossy rays see it at the present frame, in the linear working space of
    the file, laid out as precompute/lights/panorama.py says. Raises GratingError as Probe does."""
    return fit_of(world, scene, 0).panorama


def sources_of(world: bpy.types.World, scene: bpy.types.Scene, count: int) -> list[Source]:
    """The world's compact bright parts, at most `count`, the brightest first. A world of one colour needs no render.

    Raises GratingError as Probe does."""
    return [] if is_even(world) else fit_of(world, scene, count).sources


def fit_of(world: bpy.types.World, scene: bpy.types.Scene, count: int) -> Fit:
    """Panorama, sources and what they miss. Raises GratingError as Probe does."""
    probe = Probe(world, scene, count)
    probe.wait()
    return probe.result()


def _is_rendering() -> bool:
    return bpy.app.is_job_running("RENDER") or bpy.app.is_job_running("OBJECT_BAKE")


def _blender() -> list[str]:
    """The command that runs start.py in a Blender without the artist's settings and without a window."""
    if bpy.app.binary_path:
        background = ("--background", "--factory-startup", "--python-exit-code", "1")
        return [bpy.app.binary_path, *background, "--python", str(_START), "--"]
    return [sys.executable, "-P", "-s", "-B", str(_START)]


def _write_request(world: bpy.types.World, scene: bpy.types.Scene, request: dict[str, Any]) -> None:
    """Write the world into a file of its own, and beside it what such a file does not hold."""
    folder = Path(request["folder"])
    with stand_alone(world) as alone:
        blend = folder / "world.blend"
        # Of data that nothing uses, only that with a fake user is written.
        bpy.data.libraries.write(str(blend), {alone.world}, path_remap="ABSOLUTE", fake_user=True)
        pixels = []
        for number, image in enumerate(alone.painted()):
            values = np.empty(len(image.pixels), np.float32)
            image.pixels.foreach_get(values)
            np.save(folder / f"{number}.npy", values)
            pixels.append({"image": image.name, "file": f"{number}.npy"})
        request |= {
            "world": alone.world.name, "pixels": pixels, "objects": alone.objects, "frame": scene.frame_current,
            "osl": bool(scene.cycles.shading_system),
        }  # fmt: skip
    (folder / "request.json").write_text(json.dumps(request), encoding="utf-8")
