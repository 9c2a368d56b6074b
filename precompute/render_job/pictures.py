# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of a job, and the plan of a scene's pictures, which the worker in Blender reads.

A plan is JSON beside the .blend file that it is of:

    {"format": 1, "scene": "cd.blend", "recipe": SHA-256, "made_by": FACTS, "pictures": [PICTURE, ...]}

A PICTURE has the fields of Picture and under `id` the SHA-256 of everything that it depends on: a finished picture
with this id need not be rendered again."""

import hashlib
import itertools
import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..base.failure import GratingError
from ..base.files import write_whole
from .job_file import PICTURES_MAX, Job, Sweep, plain_name

PLAN_FORMAT = 1
# The folders of a job's output.
SCENES, PICTURES, LOGS = "scenes", "pictures", "logs"
SHEET = "contact_sheet.png"
# The name of the pictures of a job without gratings.
_SCENE_ALONE = "scene"


@dataclass(frozen=True)
class LampState:
    """The direction and strength of a lamp in a picture. None: as in the scene."""

    lamp: str
    azimuth_deg: float | None
    elevation_deg: float | None
    strength: float | None
    around: str | None


@dataclass(frozen=True)
class Picture:
    """A picture of a job: the name of its files without ending, and what is set before it is rendered. None keeps the
    scene's own setting."""

    name: str
    camera: str | None
    zoom: float | None
    lamps: tuple[LampState, ...]
    engine: str | None
    seed: int | None
    frame: int | None
    samples: int | None
    denoise: bool | None
    width: int | None
    height: int | None


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
    """A picture's name: that of its scene, and what changes within the scene."""
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
    return "_".join(parts)


def hash_of(record: Any) -> str:
    """The SHA-256, in hexadecimal, of a record as JSON."""
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


def plan_of(scene: str, recipe: str, pictures: Sequence[Picture], *, made_by: Mapping[str, Any]) -> dict[str, Any]:
    """The plan of a scene's pictures. `scene` is the path of its .blend relative to the plan, `recipe` a hash of
    everything that the scene depends on, `made_by` facts for the pictures' records."""
    records = [json.loads(json.dumps(asdict(picture))) for picture in pictures]
    identified = [{**record, "id": hash_of([recipe, record])} for record in records]
    return {"format": PLAN_FORMAT, "scene": scene, "recipe": recipe, "made_by": dict(made_by), "pictures": identified}


def write_record(path: Path, record: Mapping[str, Any]) -> None:
    """Write a plan or another record as JSON, whole. Raises GratingError if it cannot be written."""
    text = json.dumps(record, indent=1) + "\n"
    write_whole(path, lambda partial: partial.write_text(text, encoding="utf-8"))


def recipe_of_plan(path: Path) -> str | None:
    """The recipe of a plan and of the scene beside it; None if either is missing or damaged. A plan of 100,000 pictures
    is larger than what strict_json reads."""
    try:
        plan = json.loads(path.read_text(encoding="utf-8"))
        return str(plan["recipe"]) if (path.parent / plan["scene"]).is_file() else None
    except (OSError, KeyError, TypeError, ValueError, RecursionError):
        return None
