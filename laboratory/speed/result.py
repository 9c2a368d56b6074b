# SPDX-License-Identifier: GPL-3.0-or-later
"""What the benchmark finds, as the modules here pass it on; `as_dict` is the JSON of the verb."""

import os
import platform
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Machine:
    """What the benchmark ran on; it names no host. `load` is the load average at the start, as text."""

    processor: str
    cores: int
    system: str
    python: str
    numpy: str
    load: str


def machine() -> Machine:
    """The machine that this runs on."""
    model = platform.processor() or platform.machine()
    cpus = Path("/proc/cpuinfo")
    if cpus.is_file():
        named = [line.split(":", 1)[1].strip() for line in cpus.read_text().splitlines() if line.startswith("model n")]
        model = named[0] if named else model
    return Machine(
        processor=model,
        cores=os.cpu_count() or 1,
        system=platform.system(),
        python=platform.python_version(),
        numpy=np.__version__,
        load=f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown",
    )


@dataclass(frozen=True)
class Row:
    """A candidate on a surface.

    seconds_per_million  of evaluating a million directions
    preparation_seconds  of building the method
    peak_bytes           held at the peak of building and judging
    table_bytes          read for each direction
    peak_angle_deg       between the brightest views of the method and of its reference
    mean and the rest    error metrics as in measure.errors.Errors
    """

    surface: str
    method: str
    label: str
    model: str
    seconds_per_million: float
    preparation_seconds: float
    peak_bytes: int
    table_bytes: int
    peak_angle_deg: float
    mean: float
    p95: float
    p99: float
    max: float
    relative_rms: float
    relative_dy: float

    @property
    def title(self) -> str:
        """The method and what is particular about the candidate."""
        return f"{self.method} {self.label}".strip()

    def beats(self, other: "Row") -> bool:
        """Whether this row is cheaper than another, and no worse."""
        return self.seconds_per_million < other.seconds_per_million and self.p99 <= other.p99


@dataclass(frozen=True)
class Refusal:
    """A candidate, by its title, that cannot be built for a surface, and why."""

    surface: str
    method: str
    title: str
    reason: str


@dataclass(frozen=True)
class BenchmarkResult:
    """A run of the benchmark.

    quick         whether it was a trial of small pieces
    surface       name of the scan of Elaphe, or of the sample in its place
    xenopeltis    name of the scan of Xenopeltis, or of the sample in its place
    front         by surface, the titles of the rows on the Pareto front of seconds and p99, cheapest first
    pairs         by model of coherence, the direction pairs that a surface is judged on
    piece_um      side of the piece that methods of the ensemble model see
    """

    machine: Machine
    quick: bool
    surface: str
    xenopeltis: str
    rows: Sequence[Row]
    refused: Sequence[Refusal]
    front: dict[str, list[str]]
    pairs: dict[str, int]
    piece_um: float
    coherence_um: float
    seconds: float

    def as_dict(self) -> dict:
        """Ready for JSON."""
        return asdict(self)

    def rows_of(self, surface: str) -> list[Row]:
        """A surface's rows, cheapest first."""
        return sorted((row for row in self.rows if row.surface == surface), key=lambda row: row.seconds_per_million)

    def cheapest(self, surface: str, methods: Sequence[str], p99: float) -> Row | None:
        """The cheapest row of some methods whose 99th percentile of dE00 is at most p99, if there is one."""
        kept = [row for row in self.rows_of(surface) if row.method in methods and row.p99 <= p99]
        return kept[0] if kept else None

    def bakes_by_budget(self, surface: str) -> list[Row]:
        """The bakes of a surface, the coarsest first."""
        rows = [row for row in self.rows_of(surface) if row.method == "bake"]
        return sorted(rows, key=lambda row: -float(row.label.removeprefix("dE ")))

    def nearest(self, surface: str) -> list[Row]:
        """The bakes of a surface, the coarsest first, and of each other method the row with the least error."""
        bakes = self.bakes_by_budget(surface)
        nearest = {row.method: row for row in sorted(self.rows_of(surface), key=lambda row: -row.p99)}
        return [*bakes, *(row for row in self.rows_of(surface) if row is nearest[row.method] and row not in bakes)]
