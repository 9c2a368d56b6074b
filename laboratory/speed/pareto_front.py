# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed against error: every method on the same surfaces, in one run, so that ratios mean something, and the Pareto
front of their seconds and errors.

A method is judged by the error metrics of precompute/measure against the reference of its own model of coherence. The
zero order is left out, because a patch's window and an ensemble's kernel give it different tails. A method is timed on
directions that all have a different w.
"""

import math
import time
from collections.abc import Sequence
from pathlib import Path

from precompute.base.failure import GratingError
from precompute.base.progress import Progress, silent

from .candidates import candidates, judge
from .references import judges
from .result import BenchmarkResult, Refusal, Row, machine
from .surfaces import FULL, Effort, skin, surfaces


def pareto(points: Sequence[tuple[float, float]]) -> list[int]:
    """Indices of the points (cost, error) that no other point beats in both, cheapest first."""
    front, least = [], math.inf
    for k in sorted(range(len(points)), key=lambda k: points[k]):
        if points[k][1] < least:
            front.append(k)
            least = points[k][1]
    return front


def measure_all(effort: Effort, shared: Path, progress: Progress = silent) -> BenchmarkResult:
    """The whole benchmark. `shared` is the folder in which the real scans are looked for."""
    started = time.perf_counter()
    scan, xenopeltis = skin(shared, "elaphe"), skin(shared, "xenopeltis")
    on = machine()
    rows, refused, pairs = [], [], {}
    for surface in surfaces(effort, scan, xenopeltis):
        of_model = judges(surface, effort)
        pairs = {model: sum(len(truth.pairs.u) for truth in one.truths) for model, one in of_model.items()}
        wanted = candidates(effort)
        for k, candidate in enumerate(wanted):
            try:
                rows.append(judge(candidate, surface, of_model[candidate.model], seconds_timed=effort.seconds_timed))
            except GratingError as error:
                refused.append(Refusal(surface.name, candidate.method, candidate.title, str(error)))
            progress(surface.name, (k + 1) / len(wanted))
    return BenchmarkResult(
        machine=on,
        quick=effort is not FULL,
        surface=scan.source_name,
        xenopeltis=xenopeltis.source_name,
        rows=rows,
        refused=refused,
        front={name: front_of(rows, name) for name in dict.fromkeys(row.surface for row in rows)},
        pairs=pairs,
        piece_um=effort.piece_m * 1e6,
        coherence_um=effort.coherence_m * 1e6,
        seconds=time.perf_counter() - started,
    )


def front_of(rows: Sequence[Row], surface: str) -> list[str]:
    """Titles of the rows on a surface's Pareto front of seconds against the 99th percentile, cheapest first."""
    here = [row for row in rows if row.surface == surface]
    return [here[k].title for k in pareto([(r.seconds_per_million, r.p99) for r in here])]
