# SPDX-License-Identifier: GPL-3.0-or-later
"""The plot of a run of the benchmark."""

import math
from pathlib import Path

from precompute.base.files import write_whole
from precompute.methods.method_registry import ENTRIES

from ..study import plots
from ..study.traits import TRAITS
from .result import BenchmarkResult
from .tables import JUST_VISIBLE, NAMES

PAGE, PICTURE = "speed_against_error.md", "speed_against_error.png"


def write_picture(result: BenchmarkResult, folder: Path) -> Path:
    """Write the plot into a folder, which is made if need be. Raises GratingError if matplotlib is not installed."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / PICTURE
    pyplot = plots.pyplot()
    surfaces = list(result.front)
    figure, panels = pyplot.subplots(
        1, len(surfaces), figsize=(4.6 * len(surfaces), 5), sharey=True, squeeze=False, layout="constrained"
    )
    for panel, surface in zip(panels[0], surfaces, strict=True):
        rows = [row for row in result.rows_of(surface) if math.isfinite(row.p99)]
        for name in sorted(ENTRIES, key=lambda name: not TRAITS[name].first):
            mine = [(row.seconds_per_million, max(row.p99, 1e-3)) for row in rows if row.method == name]
            if mine:
                look = {"color": TRAITS[name].colour, "label": name, "markersize": 6, "alpha": 0.85}
                panel.plot(*zip(*mine, strict=True), TRAITS[name].marker, **look)
        front = [row for row in rows if row.title in result.front[surface]]
        panel.step(
            [row.seconds_per_million for row in front], [max(row.p99, 1e-3) for row in front], "0.5",
            where="post", linewidth=1, zorder=0,
        )  # fmt: skip
        for row in result.bakes_by_budget(surface):
            if math.isfinite(row.p99):
                panel.annotate(
                    row.label, (row.seconds_per_million, row.p99), xytext=(7, 2), textcoords="offset points",
                    fontsize=7, color=TRAITS[row.method].colour,
                )  # fmt: skip
        panel.set(xscale="log", yscale="log", title=NAMES[surface], xlabel="seconds per million directions")
        panel.axhline(JUST_VISIBLE, color="0.7", linewidth=0.8, linestyle=":")
        panel.grid(alpha=0.25)
    panels[0, 0].set_ylabel("dE00, 99th percentile, worst exposure")
    # The first surface refuses no method.
    panels[0, -1].legend(*panels[0, 0].get_legend_handles_labels(), fontsize=8, loc="upper right")
    write_whole(path, lambda partial: figure.savefig(partial, dpi=80))
    pyplot.close(figure)
    return path
