# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of docs/speed_against_error.md, from the result of a run. The sentences stand in the page itself."""

from precompute.methods.baked import ENTRY
from precompute.methods.method_registry import ENTRIES

from ..study.pages import filled, table
from ..study.traits import TRAITS
from .pictures import PAGE
from .result import BenchmarkResult
from .tables import JUST_VISIBLE, NAMES, number, table_of

BAKE = ENTRY.name
QUICK = "*A quick run: small pieces, few directions. Its ratios are no result.*"


def text(result: BenchmarkResult) -> str:
    """The page in Markdown, with the figures of a run."""
    figures = {
        "quick": QUICK if result.quick else "",
        "setting": _setting(result),
        "reached": _reached(result),
        "surfaces": "\n\n".join(_surface(result, surface) for surface in result.front),
        "choice": _choice(result),
    }
    return filled(PAGE, figures)


def _setting(result: BenchmarkResult) -> str:
    machine, pairs = result.machine, result.pairs
    rows = [
        ["machine", f"{machine.processor}, {machine.cores} cores, no GPU; load average {machine.load} at the start"],
        ["software", f"{machine.system}, Python {machine.python}, NumPy {machine.numpy}"],
        ["time of the whole run", f"{number(result.seconds / 60, 2)} minutes"],
        ["scan of Elaphe", result.surface],
        ["scan of Xenopeltis", result.xenopeltis],
        ["coherence length at 550 nm", f"{result.coherence_um:g} um"],
        ["side of the piece that a method of the ensemble model sees", f"{result.piece_um:g} um"],
        ["direction pairs a surface, ensemble model", f"{pairs['ensemble']:,}"],
        ["direction pairs a surface, patch model", f"{pairs['patch']:,}"],
    ]
    return table(["setting", "value"], rows)


def _reached(result: BenchmarkResult) -> str:
    """The table of the bakes by the dE00 that was asked for, and which of them another method beats."""
    rows = []
    for surface in result.front:
        others = [row for row in result.rows_of(surface) if row.method != BAKE]
        for row in result.bakes_by_budget(surface):
            rivals = ", ".join(other.title for other in others if other.beats(row))
            rows.append([NAMES[surface], row.label.removeprefix("dE "), number(row.p99, 2), rivals or "none"])
    return table(["surface", "dE00 asked for", "p99 reached", "faster and nearer"], rows)


def _surface(result: BenchmarkResult, surface: str) -> str:
    """The table of a surface, and which methods refused it."""
    parts = [f"### {NAMES[surface]}", table_of(result, surface)]
    refused = [one for one in result.refused if one.surface == surface]
    if refused:
        names = ", ".join(dict.fromkeys(one.title for one in refused))
        parts.append(f"Refused: {names}. Reason of the first: {refused[0].reason}.")
    return "\n\n".join(parts)


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
