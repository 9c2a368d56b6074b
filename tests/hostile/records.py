# SPDX-License-Identifier: GPL-3.0-or-later
"""Forged or damaged files for the verbs `bake` and `job`: needs files, requests with their matters, presets, jobs, and
the plans that workers read.

The files are only read, not baked: a forged value may still be a valid request, and a bake takes seconds."""

import json
import random
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from precompute.bake.needs import EVERYTHING, read_needs
from precompute.bake.request import BakeRequest, Scan
from precompute.cli.bake_verb import read_request
from precompute.presets.presets import FOLDER as PRESETS
from precompute.presets.presets import read_preset
from precompute.reflectance.matter import parse
from precompute.render_job.job_file import EXAMPLE, read_job
from precompute.render_job.pictures import pictures_of, scene_names
from precompute.render_job.plan import plan_of, read_plan

from .headers import with_lies
from .mutations import mutated
from .runner import Case, read_written

_SCAN = Scan("sample:blazed")
_MATTER = "plate 1.5, 6x(1.68+0.01i/80nm, gold/5nm), 1.56"


def cases(count: int, seed: int, folder: Path) -> Iterator[Case]:
    """Yield `count` files of each kind."""
    (folder / "job.toml").write_text(EXAMPLE)
    plan = plan_of("cd.blend", "recipe", pictures_of(read_job(folder / "job.toml"), "skin")[:3], made_by={})
    request = BakeRequest(delta_e=5.0, coherence_length_m=4e-6, matter=parse(_MATTER), scans=(_SCAN, _SCAN))
    kinds: dict[str, tuple[dict, Callable[[Path], object]]] = {
        "needs": ({**EVERYTHING.as_dict(), "measured": {"cameras": ["Camera"]}}, read_needs),
        "request": (request.as_dict(), read_request),
        "preset": (json.loads((PRESETS / "cd.json").read_text()), lambda file: read_preset(file.stem, file.parent)),
        "plan": (plan, read_plan),
    }
    for group, (record, read) in kinds.items():
        read_written(folder / f"{group}.json", json.dumps(record).encode(), read)
        for number in range(count):
            draw = random.Random(f"{seed} {group} {number}")
            whole = json.dumps(record, indent=1).encode()
            what, data = mutated(draw, whole) if number % 3 == 2 else with_lies(draw, record)
            file = folder / f"{group}{number}.json"
            yield Case(f"{group} {number}: {what}", group, partial(read_written, file, data, read), file.name)
    for number in range(count):
        what, data = mutated(random.Random(f"{seed} job {number}"), EXAMPLE.encode())
        file = folder / f"job{number}.toml"
        yield Case(f"job {number}: {what}", "job", partial(read_written, file, data, _pictures), file.name)


def _pictures(path: Path) -> object:
    """All pictures of a job."""
    job = read_job(path)
    return [pictures_of(job, name) for name in scene_names(job)]
