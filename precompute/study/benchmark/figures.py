# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of a benchmark's run as text: numbers, tables, the printed summary."""

import math
from collections.abc import Sequence

# dE00 that no eye sees side by side, the budget of a bake by default.
JUST_VISIBLE = 1.0


NAMES = {"blaze": "Blaze", "elaphe": "Elaphe", "xenopeltis": "Xenopeltis-like"}


_COLUMNS = (
    "method", "s / million", "prepared in, s", "peak, MiB", "table, MiB", "dE00 mean", "p95", "p99", "max",
    "relative RMS", "angle, degrees",
)  # fmt: skip


def number(value: float, digits: int = 3) -> str:
    """A figure of some digits, written out in full where it is large."""
    if not math.isfinite(value):
        return "-"
    if value == 0:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    if abs(value) >= 1e-4:
        return f"{round(value, digits - 1 - math.floor(math.log10(abs(value)))):,.{min(places, 6)}f}"
    return f"{value:.0e}"


def mebibytes(count: float | None) -> str:
    """Bytes in MiB."""
    return "-" if count is None else number(count / 2**20)


def title_of(row: dict) -> str:
    """A row's method and what is particular about it."""
    return f"{row['method']} {row['label']}".strip()


def rows_of(facts: dict, surface: str) -> list[dict]:
    """A surface's rows, cheapest first."""
    return sorted((row for row in facts["rows"] if row["surface"] == surface), key=lambda r: r["seconds_per_million"])


def cells_of(row: dict, front: Sequence[str]) -> list[str]:
    """A row of the table; the front is bold."""
    title = title_of(row)
    return [
        f"**{title}**" if title in front else title,
        number(row["seconds_per_million"]), number(row["preparation_seconds"], 2), mebibytes(row["peak_bytes"]),
        mebibytes(row["table_bytes"]), *(number(row[name], 2) for name in ("mean", "p95", "p99", "max")),
        number(row["relative_rms"], 2), f"{row['peak_angle_deg']:.3f}",
    ]  # fmt: skip


def table(facts: dict, surface: str) -> str:
    """A surface's rows in Markdown."""
    return markdown(_COLUMNS, [cells_of(row, facts["front"][surface]) for row in rows_of(facts, surface)])


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (header, ["---"] * len(header), *rows))


def summary(facts: dict) -> str:
    """What the command prints: the tables in columns, and the ratios."""
    lines = []
    for surface in facts["front"]:
        lines += [NAMES[surface], f"{'':36}" + "".join(f"{name:>15}" for name in _COLUMNS[1:])]
        for row in rows_of(facts, surface):
            title, *cells = cells_of(row, ())
            mark = "*" if title in facts["front"][surface] else " "
            lines.append(f"{mark} {title:<34}" + "".join(f"{cell:>15}" for cell in cells))
    scan, one_map = facts["scan"], facts["map"]
    lines += [
        "* on the front of seconds against p99",
        f"bake of {facts['surface']}: {number(scan['bake_to_24_transforms'])} x 24 transforms of its size, "
        f"{number(scan['naive_to_bake'])} x faster than a transform a wavelength and tile, "
        f"{mebibytes(scan['peak_bytes'])} MiB at the peak, {mebibytes(scan['table_bytes'])} MiB in Blender",
        f"map of {one_map['pixels']} x {one_map['pixels']}: {number(one_map['flss_to_bake'])} x faster than FLSS, dE00 "
        f"mean {number(one_map['bake']['mean'])} and p99 {number(one_map['bake']['p99'])}, not "
        f"{number(one_map['flss']['mean'])} and {number(one_map['flss']['p99'])}",
    ]
    for size in facts["sizes"]:
        lines.append(
            f"bake of {size['pixels']} x {size['pixels']}: {number(size['seconds'])} s, check "
            f"{number(size['check_seconds'])} s, {mebibytes(size['beyond_input_bytes'])} MiB beyond the input"
        )
    return "\n".join(lines)


def n2_log_n(pixels: int) -> float:
    """What a transform of pixels x pixels costs, but for a factor."""
    return pixels**2 * math.log2(pixels)


def cheapest(facts: dict, surface: str, methods: Sequence[str], p99: float = JUST_VISIBLE) -> dict | None:
    """The cheapest row of some methods that keeps to a dE00, if any does."""
    kept = [row for row in rows_of(facts, surface) if row["method"] in methods and row["p99"] <= p99]
    return kept[0] if kept else None


def bakes_by_budget(facts: dict, surface: str) -> list[dict]:
    """The bakes that were asked for by a dE00 alone, the coarsest first."""
    rows = [row for row in rows_of(facts, surface) if row["method"] == "bake" and "," not in row["label"]]
    return sorted(rows, key=lambda row: -float(row["label"].removeprefix("dE ")))


def beats(one: dict, other: dict) -> bool:
    """Whether a row is cheaper than another, and no worse."""
    return one["seconds_per_million"] < other["seconds_per_million"] and one["p99"] <= other["p99"]
