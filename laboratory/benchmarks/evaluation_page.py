# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of docs/evaluation.md, computed by laboratory.benchmarks.evaluation. The sentences stand in the page."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..study.pages import filled, table
from .evaluation_maps import Agreement

COLUMNS = 4
STAND_INS = "*The scans were missing in this run: `sample:elaphe` and `sample:xenopeltis` take their places.*"
NO_MAPS = "unknown, because the thesis's maps were missing in this run"


@dataclass(frozen=True)
class Facts:
    """The facts that the page reports.

    They are: whether the skins are the real scans; the rows of each surface; the bakes' colours; the variance of the
    blaze's period where peaks are samples of a grid; the periods of the pieces of each skin in nanometres; the rows of
    the table of terms; the agreement of maps with the thesis's pictures."""

    scan: bool
    tables: dict[str, list]
    bakes: dict
    grid_variance: float
    patches: dict[str, list[float]]
    terms: list[dict]
    agreements: list[Agreement]

    def as_dict(self) -> dict:
        """The facts for JSON."""
        rows = {
            name: [{"label": row.label, "thesis": row.thesis, **row.evaluation.as_dict()} for row in table]
            for name, table in self.tables.items()
        }
        bakes = {name: bake.as_dict() for name, bake in self.bakes.items()}
        return {**vars(self), "tables": rows, "bakes": bakes, "agreements": [vars(one) for one in self.agreements]}


def text(facts: Facts, groups: dict) -> str:
    """The page with new figures."""
    figures = {
        "stand-ins": "" if facts.scan else STAND_INS,
        "table 5.1": thesis_table(facts.tables),
        "grid": f"{facts.grid_variance:.3f}",
        "bakes": bake_table(facts.bakes),
        "agreement": agreement(facts.agreements),
    }
    figures |= {f"periods of {name}": spread(periods_nm) for name, periods_nm in facts.patches.items()}
    figures |= {f"maps of {name}": map_table(maps) for name, maps in groups.items()}
    return filled("evaluation.md", figures)


def thesis_table(tables: dict[str, list]) -> str:
    """The table of every row that has a mean and a variance of the thesis."""
    lines = []
    for surface, rows in tables.items():
        for row in (row for row in rows if row.thesis):
            own = row.evaluation.as_dict()
            ours = f"{own['period_mean_nm']:.2f} / {own['period_variance_nm']:.3g}"
            lines.append([surface, row.thesis, ours, row.label])
    return table(["surface", "thesis, nm / nm^2", "ours, nm / nm^2", "ours is"], lines)


def spread(periods_nm: list[float]) -> str:
    """The range, the mean and the standard deviation of the periods of a surface's pieces."""
    low, high, mean = min(periods_nm), max(periods_nm), np.mean(periods_nm)
    return f"{low:.0f} to {high:.0f} nm (mean {mean:.1f}, standard deviation {np.std(periods_nm):.1f})"


def agreement(agreements: Sequence[Agreement]) -> str:
    """The range and the median of the rank correlations of our maps with the thesis's."""
    values = [value for one in agreements for value in one.upright]
    if not values:
        return NO_MAPS
    least, most, median = min(values), max(values), np.median(values)
    return f"{least:.2f} to {most:.2f}, with a median of {median:.2f}, in {len(agreements)} maps"


def bake_table(bakes: dict) -> str:
    """The table that compares each surface's bake with its reference."""
    lines = []
    for name, one in bakes.items():
        off = one.dominant_wavelength_rms_nm
        angles = [f"{one.peak_angle_deg:.3f}", f"{one.reference_peak_angle_deg:.3f}"]
        lines.append([name, *angles, "none" if off is None else f"{off:.2f}", f"{one.relative_dy:.2%}"])
    head = ["surface", "brightest, degrees", "the reference", "dominant wavelength, rms nm", "sum of abs dY / sum of Y"]
    return table(head, lines)


def map_table(maps: Sequence) -> str:
    """A table of pictures with captions. A caption also names the thesis's picture of the same map, where there is
    one."""
    cells = []
    for one in maps:
        beside = f"<br>`{one.thesis.removeprefix('brdfmap__')}`" if one.thesis else ""
        cells.append(f"![{one.caption}](images/evaluation/{one.name}.png)<br>{one.caption}{beside}")
    width = min(COLUMNS, len(cells))
    cells += [""] * (-len(cells) % width)
    return table([""] * width, [cells[k : k + width] for k in range(0, len(cells), width)])
