# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitting light sources to each frame of an animated world, in a second Blender process for each frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

import bpy

from ....precompute.base.failure import GratingError
from ....precompute.base.progress import Progress, silent
from ...lamps.sky import SOURCES_MAX, hold_frames
from ...materials.skin import show_lamps
from ...worlds.world_changes import fingerprint
from ...worlds.world_probe import Fit, Probe
from .fitting_worlds import world_is_animated

# More keys make Blender slow, and their fits take days.
_FRAMES_MAX = 10_000


def fit_frames(
    scene: bpy.types.Scene, *, first: int = -1, last: int = -1, step: int = 0, progress: Progress = silent
) -> str:
    """Fit a range of frames and wait; by default the scene's own range and step. Returns a line to report. Raises
    GratingError as FrameFits does."""
    job = FrameFits.of_range(scene, first=first, last=last, step=step)
    job.wait(progress)
    return job.keep()


@dataclass
class FrameFits:
    """A job that fits the scene's world in each of some frames. The scene goes to these frames one after another, and
    back when the job ends. Nothing is stored before `keep`.

    Poll `running`, or call `wait`."""

    scene: bpy.types.Scene
    frames: list[int]
    fits: dict[int, Fit] = field(default_factory=dict)
    fingerprints: dict[int, str] = field(default_factory=dict)
    _probe: Probe | None = None

    def __post_init__(self) -> None:
        """Start the first fit. Raises GratingError if the world is not animated or the range is unusable."""
        world = self.scene.world
        name = f"world {world.name}" if world is not None else "world"
        if not world_is_animated(self.scene):
            raise GratingError(name, "it is not animated", "press Fit World instead")
        if not 0 < len(self.frames) <= _FRAMES_MAX:
            raise GratingError(
                f"{len(self.frames)} frames", f"a fit takes from 1 to {_FRAMES_MAX}", "choose another range"
            )
        self._name, self._before = self.scene.name_full, (self.scene.frame_current, self.scene.frame_subframe)
        self._start()

    @classmethod
    def of_range(cls, scene: bpy.types.Scene, *, first: int, last: int, step: int) -> Self:
        """A job for a range of frames. A negative frame or a step of 0 is the scene's own."""
        first = scene.frame_start if first < 0 else first
        last = scene.frame_end if last < 0 else last
        return cls(scene, list(range(first, last + 1, step or scene.frame_step)))

    @property
    def running(self) -> bool:
        """Whether a fit is still to be done. Starts the next one if the last has ended."""
        if self._probe is not None and not self._probe.running:
            self._take()
        return self._probe is not None

    def wait(self, progress: Progress = silent) -> None:
        """Do all fits, and report each frame. An interrupt cancels the job."""
        try:
            while self._probe is not None:
                progress(*self.progress())
                self._probe.wait()
                self._take()
            progress(*self.progress())
        except BaseException:
            self.cancel()
            raise

    def progress(self) -> tuple[str, float]:
        """The present frame in words, and the share of the frames that are done."""
        return f"frame {self.frames[min(len(self.fits), len(self.frames) - 1)]}", len(self.fits) / len(self.frames)

    def cancel(self) -> None:
        """Stop, and return to the frame before."""
        probe, self._probe = self._probe, None
        if probe is not None:
            probe.cancel()
        self._go_back()

    def keep(self) -> str:
        """Store the sources of all frames as keys. Returns a line to report. Raises GratingError if that is
        impossible."""
        sources = {frame: fit.sources for frame, fit in self.fits.items()}
        most = max(fit.missed for fit in self.fits.values())
        try:
            hold_frames(self.scene, sources, fingerprints=self.fingerprints, missed=most)
        except RuntimeError as error:
            fault = str(error).strip().splitlines()[-1]
            raise GratingError(
                self.scene.name, f"its keys cannot be edited ({fault})", "make its action local"
            ) from None
        show_lamps(exactly=False)
        most_spots = max(map(len, sources.values()))
        spots = f"{most_spots} bright spot{'s' * (most_spots != 1)}"
        return f"{len(sources)} frames fitted, {min(sources)} to {max(sources)}; at most {spots} in each"

    def _start(self) -> None:
        frame = self.frames[len(self.fits)]
        self.scene.frame_set(frame)
        self.fingerprints[frame] = fingerprint(self.scene.world)
        try:
            self._probe = Probe(self.scene.world, self.scene, SOURCES_MAX)
        except GratingError:
            self._go_back()
            raise

    def _take(self) -> None:
        probe, self._probe = self._probe, None
        assert probe is not None  # running and wait look for it first
        try:
            self.fits[self.frames[len(self.fits)]] = probe.result()
        except GratingError:
            self._go_back()
            raise
        if len(self.fits) < len(self.frames):
            self._start()
        else:
            self._go_back()

    def _go_back(self) -> None:
        if bpy.data.scenes.get(self._name) is self.scene:
            frame, subframe = self._before
            self.scene.frame_set(frame, subframe=subframe)
