# SPDX-License-Identifier: GPL-3.0-or-later
"""Looking at a world with a second Blender in the background.

A render in this Blender would replace the artist's Render Result and block the interface. So second_blender.py renders
a saved copy of the world in a Blender with factory settings: a panorama, and closer looks at small bright parts."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...precompute.base.child_process import ChildProcess, inherited_environment, lines_of
from ...precompute.base.failure import GratingError
from ...precompute.base.strict import read_json
from ...precompute.world_sources.sources import Source
from ..blender.session import is_rendering
from ..jobs.child import background_blender
from .second_blender import stand_alone

_START = Path(__file__).with_name("start_second_blender.py")
# The time limit. Pictures of 16384 x 8192 pixels load in seconds, so more time indicates a fault.
_LONGEST_SECONDS = 300


@dataclass(frozen=True)
class Fit:
    """The result of a probe.

    panorama    (rows, cols, 3) radiance of the world, laid out as in precompute/world_sources/sources.py
    sources     brightest first
    missed      share of the light that is bright and compact but in no source, 0 to 1"""

    panorama: np.ndarray
    sources: list[Source]
    missed: float


class Probe(ChildProcess):
    """A running look at a world. Poll `running` or call `wait`, then take the `result`."""

    def __init__(self, world: bpy.types.World, scene: bpy.types.Scene, count: int) -> None:
        """Start a search for at most `count` sources. Raises GratingError if no file can be written, or while a render
        is running: it reads data that copying the world would change."""
        if is_rendering():
            raise GratingError(
                f"world {world.name}", "not fitted while a render is running", "try again when it has ended"
            )
        self._name = world.name

        def prepare(private: Path) -> list[str]:
            _write_request(world, scene, {"folder": str(private), "count": count})
            return background_blender(_START, str(private / "request.json"))

        super().__init__(prepare, inherited_environment(), longest_seconds=_LONGEST_SECONDS)

    def result(self) -> Fit:
        """The result after the process has ended. Raises GratingError if the second Blender failed or took too long."""
        try:
            if self.is_late:
                raise GratingError(
                    f"world {self._name}",
                    f"not rendered within {_LONGEST_SECONDS} s",
                    "use smaller pictures, and none from a drive that does not answer",
                )
            if self.status == 0:
                found = read_json(self.folder / "fit.json", "try again")
                sources = [
                    Source(np.array(one["direction"]), np.array(one["irradiance"]), one["variance"])
                    for one in found["sources"]
                ]
                return Fit(np.load(self.folder / "panorama.npy"), sources, found["missed"])
            told = lines_of(self.out_path) + lines_of(self.err_path)
        finally:
            self.clean_up()
        last = next((line for line in reversed(told) if line.strip()), "no message")
        raise GratingError(f"world {self._name}", f"not rendered ({last})", "check its nodes and pictures")


def fit_of(world: bpy.types.World, scene: bpy.types.Scene, count: int) -> Fit:
    """The panorama, its sources, and the missed share. Waits for a Probe and raises GratingError as it does."""
    probe = Probe(world, scene, count)
    probe.wait()
    return probe.result()


def _write_request(world: bpy.types.World, scene: bpy.types.Scene, request: dict[str, Any]) -> None:
    """Save the world to a file, and write a request with everything that the file lacks."""
    folder = Path(request["folder"])
    with stand_alone(world) as alone:
        blend = folder / "world.blend"
        # For unused data, Blender writes only data-blocks with a fake user.
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
