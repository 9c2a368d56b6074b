# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of docs/speed_against_error.md, from the result of a run. The sentences stand in the page itself."""

from precompute.methods.baked import ENTRY
from precompute.methods.method_registry import ENTRIES

from ..study.pages import filled, table
from ..study.traits import TRAITS
from .pictures import PAGE
from .result import BenchmarkResult
from .tables import JUST_VISIBLE, NAMES, mebibytes, n2_log_n, number, table_of

BAKE = ENTRY.name
BEYOND_INPUT_MAX = 2 * 2**30
QUICK = "*A quick run: small pieces, few directions. Its ratios are no result.*"


def text(result: BenchmarkResult) -> str:
    """The page in Markdown, with the figures of a run."""
    figures = {
        "quick": QUICK if result.quick else "",
        "setting": _setting(result),
        "scan": _scan(result),
        "map pixels": f"{result.map.pixels} x {result.map.pixels}",
        "map": _map(result),
        "map ratio": f"{number(result.map.flss_to_bake)} times (aim 500: {_met(result.map.flss_to_bake >= 500)})",
        "reached": _reached(result),
        "surfaces": "\n\n".join(_surface(result, surface) for surface in result.front),
        "sizes": _sizes(result),
        "choice": _choice(result),
    }
    return filled(PAGE, figures)


def _met(is_met: bool) -> str:
    return "met" if is_met else "missed"


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


def _scan(result: BenchmarkResult) -> str:
    scan = result.scan
    (rows, columns), (tile_rows, tile_columns) = scan.pixels, scan.tile
    share = scan.check_seconds / scan.bake_seconds
    checked = ", ".join(number(value, 2) for value in (scan.delta_e.mean, scan.delta_e.p95, scan.delta_e.p99))
    naive = f"{scan.naive_transforms} transforms ({scan.wavelengths} wavelengths, {scan.tiles} values of w)"
    lines = [
        ["scan", f"{result.surface}, {rows} x {columns} pixels", ""],
        ["tiles", f"{scan.tiles} of {tile_columns} x {tile_rows}, coherence {scan.coherence_um:.1f} um", ""],
        ["one transform of the scan's size", f"{number(scan.transform_seconds * 1e3)} ms", ""],
        ["bake", f"{number(scan.bake_seconds)} s", ""],
        ["self-check", f"{number(scan.check_seconds)} s", ""],
        [f"naive bake: {naive}, {scan.naive_timed} of them timed", f"{number(scan.naive_seconds)} s", ""],
        ["bake, in 24 transforms", f"{number(scan.bake_to_24_transforms)} x", "6 x, aim 3 x"],
        ["self-check, as a share of the bake", number(share, 2), "1" if share <= 1 else "1, missed"],
        ["bake, faster than the naive bake", f"{number(scan.naive_to_bake)} x", "10 x"],
        ["peak memory of the process", f"{mebibytes(scan.peak_bytes)} MiB", "1024 MiB"],
        ["table in Blender", f"{mebibytes(scan.table_bytes)} MiB", "128 MiB"],
        ["dE00 by the self-check: mean, p95, p99", checked, "p99 of 1"],
    ]
    return table(["", "measured", "limit"], lines)


def _map(result: BenchmarkResult) -> str:
    one, scan = result.map, result.scan
    by_method = (
        ("bake", one.bake_seconds, scan.bake_seconds, f"{scan.coherence_um:.1f}", one.bake),
        ("FLSS", one.flss_seconds, one.flss_preparation_seconds, "65", one.flss),
    )
    rows = [
        [name, number(seconds), number(before), length, f"{errors.pairs}", f"{one.reference_step_nm:g}"]
        + [number(value, 2) for value in (errors.mean, errors.p95, errors.p99, errors.relative_rms)]
        for name, seconds, before, length, errors in by_method
    ]
    head = ["", "seconds", "prepared in, s", "coherence, um", "pairs", "reference's step, nm"]
    return table([*head, "dE00 mean", "p95", "p99", "relative RMS"], rows)


def _reached(result: BenchmarkResult) -> str:
    """The table of the bakes that were asked for by a dE00, and which of them another method beats.

    Bakes with other terms or texels than their plan's are no rivals: they are bakes too."""
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


def _sizes(result: BenchmarkResult) -> str:
    largest = result.sizes[-1].seconds / n2_log_n(result.sizes[-1].pixels)
    rows = [
        [
            f"{one.pixels}²", number(one.seconds),
            number(one.seconds / n2_log_n(one.pixels) / largest), number(one.check_seconds),
            mebibytes(one.beyond_input_bytes), _met((one.beyond_input_bytes or 0) <= BEYOND_INPUT_MAX),
            mebibytes(one.input_bytes), number(one.delta_e_p99, 2),
        ]
        for one in result.sizes
    ]  # fmt: skip
    head = ["pixels", "bake, s", "per n² log n", "check, s", "MiB beyond the input", "limit", "the input, MiB"]
    return table([*head, "dE00 p99"], rows)


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
