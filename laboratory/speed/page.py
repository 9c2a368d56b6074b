# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of a run as text and as a plot: the printed summary, and the figures of docs/speed.md. The sentences stand
in the page itself."""

import math
from pathlib import Path

from precompute.base.files import write_whole
from precompute.methods.baked import ENTRY
from precompute.methods.method_registry import ENTRIES

from ..study import plots
from ..study.pages import filled, table
from ..study.traits import TRAITS
from .result import BenchmarkResult, Row

PAGE, PICTURE = "speed.md", "speed_against_error.png"
# The names of this program's places in the page begin so.
PART = "core "
BAKE = ENTRY.name
QUICK = "*A quick run: small pieces, few directions. Its ratios are no result.*"
# dE00 that no eye sees side by side, the budget of a bake by default.
JUST_VISIBLE = 1.0
NAMES = {"blaze": "Blaze", "elaphe": "Elaphe", "xenopeltis": "Xenopeltis"}
_COLUMNS = (
    "method", "s / million", "prepared in, s", "peak, MiB", "table, MiB", "dE00 mean", "p95", "p99", "max",
    "relative RMS", "angle, degrees",
)  # fmt: skip


def number(value: float, digits: int = 3) -> str:
    """A value rounded to `digits` significant digits, written out in full where it is large."""
    if not math.isfinite(value):
        return "-"
    if value == 0:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    if abs(value) >= 1e-4:
        return f"{round(value, digits - 1 - math.floor(math.log10(abs(value)))):,.{min(places, 6)}f}"
    return f"{value:.0e}"


def mebibytes(count: float | None) -> str:
    """A number of bytes in MiB, or a dash if it is not known."""
    return "-" if count is None else number(count / 2**20)


def cells_of(row: Row) -> list[str]:
    """A row of a surface's table."""
    return [
        row.title,
        number(row.seconds_per_million), number(row.preparation_seconds, 2), mebibytes(row.peak_bytes),
        mebibytes(row.table_bytes), *(number(value, 2) for value in (row.mean, row.p95, row.p99, row.max)),
        number(row.relative_rms, 2), f"{row.peak_angle_deg:.3f}",
    ]  # fmt: skip


def summary(result: BenchmarkResult) -> str:
    """What the command prints: a table for each surface in columns, and the methods that refused a surface."""
    lines = []
    for surface in result.front:
        lines += [NAMES[surface], f"{'':36}" + "".join(f"{name:>15}" for name in _COLUMNS[1:])]
        for row in result.rows_of(surface):
            title, *cells = cells_of(row)
            mark = "*" if title in result.front[surface] else " "
            lines.append(f"{mark} {title:<34}" + "".join(f"{cell:>15}" for cell in cells))
    lines.append("* on the front of seconds against p99")
    lines += [f"refused: {NAMES[one.surface]}, {one.title}: {one.reason}" for one in result.refused]
    return "\n".join(lines)


def text(result: BenchmarkResult) -> str:
    """The page in Markdown, with the figures of a run."""
    figures = {
        "core quick": QUICK if result.quick else "",
        "core setting": _setting(result),
        "core methods": _methods(result),
        "core choice": _choice(result),
    }
    return filled(PAGE, figures, part=PART)


def _setting(result: BenchmarkResult) -> str:
    machine, pairs = result.machine, result.pairs
    rows = [
        ["machine", f"{machine.processor}, {machine.cores} cores, Python {machine.python}, NumPy {machine.numpy}"],
        ["whole run", f"{number(result.seconds / 60, 2)} minutes"],
        ["scans", f"{result.surface}, {result.xenopeltis}"],
        ["coherence length, piece of the scan", f"{result.coherence_um:g} um, {result.piece_um:g} um"],
        ["direction pairs, ensemble and patch model", f"{pairs['ensemble']:,}, {pairs['patch']:,}"],
    ]
    return table(["setting", "value"], rows)


def _methods(result: BenchmarkResult) -> str:
    """The table of every bake, and of the nearest row of every other method, on each surface."""
    rows: dict[str, dict[str, Row]] = {}
    for surface in result.front:
        for row in result.nearest(surface):
            rows.setdefault(row.title if row.method == BAKE else row.method, {})[surface] = row
    lines = [[name, *(_cell(found.get(surface)) for surface in result.front)] for name, found in rows.items()]
    return table(["seconds, p99", *(NAMES[surface] for surface in result.front)], lines)


def _cell(row: Row | None) -> str:
    return "refused" if row is None else f"{number(row.seconds_per_million)}, {number(row.p99, 2)}"


def _choice(result: BenchmarkResult) -> str:
    """The table of the cheapest bake beside the cheapest other method, both within a dE00 of 1."""
    rivals = [name for name in ENTRIES if name != BAKE and not TRAITS[name].is_reference]
    rows = []
    for surface in result.front:
        bake = result.cheapest(surface, (BAKE,), JUST_VISIBLE)
        other = result.cheapest(surface, rivals, JUST_VISIBLE)
        row = [NAMES[surface], bake.title if bake else "none", other.title if other else "none", "-", "-"]
        if bake and other:
            saved = max(other.seconds_per_million - bake.seconds_per_million, 1e-9)
            row[3] = f"{number(other.seconds_per_million / bake.seconds_per_million)} x"
            row[4] = number(1e6 * bake.preparation_seconds / saved, 2)
        rows.append(row)
    return table(["surface", "cheapest bake", "cheapest other method", "bake faster by", "pays back after"], rows)


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
