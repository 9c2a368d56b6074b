# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of a job, and their names."""

import itertools
import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

from ..base.failure import GratingError
from .job_file import Job, Sweep
from .plan import PICTURES_MAX, LampState, Picture, plain_name

SHEET = "contact_sheet.png"
# The name of the pictures of a job without gratings.
_SCENE_ALONE = "scene"


def scene_names(job: Job) -> list[str]:
    """The names of a job's scenes: one for each surface, or one without surfaces."""
    return [surface.name for surface in job.surfaces] or [_SCENE_ALONE]


def pictures_of(job: Job, scene_name: str) -> list[Picture]:
    """The pictures of one of a job's scenes, all combinations, the frames last. Raises GratingError if the whole job
    has more than PICTURES_MAX, or if two pictures would have the same name."""
    if (count := _count(job)) > PICTURES_MAX:
        raise GratingError(job.path, f"{count} pictures", f"split the job: at most {PICTURES_MAX}")
    lamps = [_states(sweep) for sweep in job.sweeps]
    axes: list[Sequence[Any]] = [job.views.cameras or (None,), job.views.zooms or (None,), *lamps, _renderings(job)]
    axes.append(job.views.frames or (None,))
    found = [
        Picture(
            _name(job, scene_name, choice), choice[0], choice[1], tuple(choice[2:-2]), choice[-2][0], choice[-2][1],
            choice[-1], job.views.samples, job.views.denoise, job.views.width, job.views.height,
        )
        for choice in itertools.product(*axes)
    ]  # fmt: skip
    ((double, times),) = Counter(picture.name.lower() for picture in found).most_common(1)
    if times > 1:
        raise GratingError(job.path, f"two pictures would be {double}.png", "rename the cameras or lamps that differ")
    return found


def _count(job: Job) -> int:
    """The number of a job's pictures, counted before any of them is made."""
    swept = [values for sweep in job.sweeps for values in (sweep.azimuth_deg, sweep.elevation_deg, sweep.strength)]
    axes = [scene_names(job), job.views.cameras, job.views.zooms, job.views.frames, *swept, _renderings(job)]
    return math.prod(max(1, len(axis)) for axis in axes)


def _renderings(job: Job) -> list[tuple[str | None, int | None]]:
    """Engines with their seeds. EEVEE has no seed, so it renders with the first only."""
    seeds: Sequence[int | None] = job.views.seeds or (None,)
    return [(e, s) for e in job.views.engines or (None,) for s in (seeds[:1] if e == "eevee" else seeds)]


def _states(sweep: Sweep) -> list[LampState]:
    axes = (sweep.azimuth_deg or (None,), sweep.elevation_deg or (None,), sweep.strength or (None,))
    return [LampState(sweep.lamp, *choice, sweep.around) for choice in itertools.product(*axes)]


def _name(job: Job, scene_name: str, choice: Sequence[Any]) -> str:
    """A picture's name: that of its scene, and what changes within the scene, shortened if it is too long."""
    camera, zoom, *lamps, (engine, seed), frame = choice
    parts = [scene_name]
    if len(job.views.cameras) > 1:
        parts.append(plain_name(camera))
    if len(job.views.zooms) > 1:
        parts.append(f"x{zoom:g}")
    for sweep, state in zip(job.sweeps, lamps, strict=True):
        changed = [
            f"{letter}{getattr(state, field):g}"
            for letter, field in (("a", "azimuth_deg"), ("e", "elevation_deg"), ("s", "strength"))
            if len(getattr(sweep, field)) > 1
        ]
        if changed:
            parts.append("-".join([plain_name(sweep.lamp), *changed]))
    if len(job.views.engines) > 1:
        parts.append(engine)
    if len(job.views.seeds) > 1:
        parts.append(f"seed{seed}")
    if frame is not None:
        parts.append(f"{frame:04d}")
    return plain_name("_".join(parts))
