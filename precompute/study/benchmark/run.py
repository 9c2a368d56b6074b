# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed against error: every method of the core on the same surfaces, in one run, so that ratios mean something.

A method is judged by precompute.metric against the reference of its own model of coherence, away from the zero order
(which a patch's tails and an ensemble's kernel draw differently), and timed on directions of which no two share a w.
"""

import math
import os
import platform
import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from ...base.failure import GratingError
from ...surface.relief import prepare
from .candidates import Refusal, Row, candidates, judge
from .references import judges
from .scan import Tick, map_facts, scan_facts, scan_in_child
from .surfaces import FULL, Effort, elaphe_scan, middle, surfaces


def pareto(points: Sequence[tuple[float, float]]) -> list[int]:
    """Indices, cheapest first, of the points (cost, error) that no other beats in both."""
    front, least = [], math.inf
    for k in sorted(range(len(points)), key=lambda k: points[k]):
        if points[k][1] < least:
            front.append(k)
            least = points[k][1]
    return front


def machine() -> dict[str, str | int]:
    """What the figures were measured on; no names of hosts."""
    model = platform.processor() or platform.machine()
    cpus = Path("/proc/cpuinfo")
    if cpus.is_file():
        named = [line.split(":", 1)[1].strip() for line in cpus.read_text().splitlines() if line.startswith("model n")]
        model = named[0] if named else model
    return {
        "processor": model,
        "cores": os.cpu_count() or 1,
        "system": platform.system(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "load": f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown",
    }


def run(effort: Effort, shared: Path, tick: Tick = lambda stage, fraction: None) -> dict:
    """The whole benchmark; its facts, as `--json` gives them."""
    started = time.perf_counter()
    scan = elaphe_scan(shared)
    judged = middle(scan, effort.scan_m) if effort.scan_m else replace(scan, periodic=False)
    facts: dict = {"machine": machine(), "quick": effort is not FULL, "surface": scan.source_name}
    facts["scan"], baked = scan_facts(judged, effort, tick)
    facts["map"] = map_facts(prepare(judged), baked, effort, tick)
    rows, refused, pairs = [], [], {}
    for surface in surfaces(effort, scan):
        of_model = judges(surface, effort)
        pairs = {model: sum(len(truth.pairs.u) for truth in one.truths) for model, one in of_model.items()}
        wanted = candidates(effort)
        for k, candidate in enumerate(wanted):
            try:
                rows.append(judge(candidate, surface, of_model[candidate.model], effort))
            except GratingError as error:
                refused.append(Refusal(surface.name, candidate.method, candidate.label, str(error)))
            tick(surface.name, (k + 1) / len(wanted))
    facts["rows"] = [asdict(row) for row in rows]
    facts["refused"] = [asdict(refusal) for refusal in refused]
    facts["front"] = {name: front_of(rows, name) for name in dict.fromkeys(row.surface for row in rows)}
    facts["sizes"] = []
    for k, pixels in enumerate(effort.sizes):
        facts["sizes"].append(scan_in_child(pixels))
        tick("sizes", (k + 1) / len(effort.sizes))
    facts["pairs"], facts["piece_um"] = pairs, effort.piece_m * 1e6
    facts["coherence_um"] = effort.coherence_m * 1e6
    facts["seconds"] = time.perf_counter() - started
    return facts


def front_of(rows: Sequence[Row], surface: str) -> list[str]:
    """Methods and labels on a surface's Pareto front of seconds against the 99th percentile, cheapest first."""
    here = [row for row in rows if row.surface == surface]
    return [f"{here[k].method} {here[k].label}".strip() for k in pareto([(r.seconds_per_million, r.p99) for r in here])]
