# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of the benchmark as text: numbers, tables, the printed summary."""

import math
from collections.abc import Sequence

from ..study.pages import table
from .result import BenchmarkResult, Row

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


def cells_of(row: Row, front: Sequence[str]) -> list[str]:
    """A row of the table; a title on the front is bold."""
    return [
        f"**{row.title}**" if row.title in front else row.title,
        number(row.seconds_per_million), number(row.preparation_seconds, 2), mebibytes(row.peak_bytes),
        mebibytes(row.table_bytes), *(number(value, 2) for value in (row.mean, row.p95, row.p99, row.max)),
        number(row.relative_rms, 2), f"{row.peak_angle_deg:.3f}",
    ]  # fmt: skip


def table_of(result: BenchmarkResult, surface: str) -> str:
    """The shown rows of a surface in Markdown."""
    return table(_COLUMNS, [cells_of(row, result.front[surface]) for row in result.shown(surface)])


def summary(result: BenchmarkResult) -> str:
    """What the command prints: the tables in columns, and the ratios."""
    lines = []
    for surface in result.front:
        lines += [NAMES[surface], f"{'':36}" + "".join(f"{name:>15}" for name in _COLUMNS[1:])]
        for row in result.rows_of(surface):
            title, *cells = cells_of(row, ())
            mark = "*" if title in result.front[surface] else " "
            lines.append(f"{mark} {title:<34}" + "".join(f"{cell:>15}" for cell in cells))
    lines.append("* on the front of seconds against p99")
    return "\n".join(lines)
