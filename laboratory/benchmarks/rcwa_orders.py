# SPDX-License-Identifier: GPL-3.0-or-later
"""How far single orders, and the light of all orders, are from Maxwell's equations, by five factors of the spectrum.

    ./dev bench rcwa_orders [--quick] [--picture FILE] [--json FILE|-]

rcwa_orders_rows.py has the gratings and the factors. The tables
of single orders leave out orders of less than LEAST of the light: RCWA's own error is about that large. `--picture`
draws how far the first orders of keratin are off, by depth and period.
"""

import importlib.util
import io
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from precompute.base.files import write_whole
from precompute.cli.parser import OneLineParser

from ..study import plots
from ..study.efficiency import PROFILES
from . import report
from .rcwa import PARTS, Grating
from .rcwa_orders_rows import (
    DEEP,
    DEPTHS,
    FILMS,
    METALS,
    RATIO,
    SHALLOW,
    SUM_ANGLES_DEG,
    Row,
    Total,
    cases,
    extra_orders,
    films_of,
    flat_reflectance,
    holds_reflectance,
    is_of,
    measure,
    off_by,
    rigorous_orders,
    scalar_orders,
    steep,
)

RANGES_DEG = ((0, 30), (30, 60), (60, 75), (75, 90))
SUM_DEPTHS = (0.1, 0.25, 0.5)
INDICES: dict[str, complex] = {"n = 1.56": 1.56, "n = 2.5": 2.5, "n = 3": 3.0, "n = 10": 10.0, **METALS}
LEAST = 1e-4
NEAR = 0.05


def kept(rows: Iterable[Row]) -> list[Row]:
    """The rows that hold at least LEAST of the light by RCWA."""
    return [row for row in rows if row.rigorous >= LEAST]


def _is_keratin(case: Grating) -> bool:
    return not holds_reflectance(case)


def _groups() -> dict[str, Callable[[Row], bool]]:
    """Groups of orders by their titles. The first ones are of keratin."""

    def shallow(row: Row) -> bool:
        return _is_keratin(row.case) and row.case.depth in SHALLOW

    def first(row: Row) -> bool:
        return abs(row.order) == 1 and shallow(row)

    groups: dict[str, Callable[[Row], bool]] = {
        "first orders, depth to 0.2, in the plane": lambda row: first(row) and row.case.azimuth_deg == 0,
        "first orders, depth to 0.2, out of the plane": lambda row: first(row) and row.case.azimuth_deg > 0,
    }
    for kind in PROFILES:
        groups[f"the same, {kind}"] = lambda row, kind=kind: (
            first(row) and row.case.azimuth_deg > 0 and row.case.kind == kind
        )
    groups |= {
        "other orders but the mirror image, depth to 0.2": lambda row: abs(row.order) > 1 and shallow(row),
        "mirror image, depth to 0.2": lambda row: row.order == 0 and shallow(row),
        "first orders, depth 0.4": lambda row: abs(row.order) == 1 and _is_keratin(row.case) and row.case.depth == DEEP,
    }
    for name, deepest in product((*METALS, *FILMS), SHALLOW[1:]):
        groups[f"{name}, first orders, depth to {deepest:g}, in the plane"] = lambda row, name=name, deepest=deepest: (
            abs(row.order) == 1 and row.case.depth <= deepest and is_of(row.case, name)
        )
    return groups


def order_table(rows: Sequence[Row]) -> str:
    """Median (90th percentile) of the factor, at least 1, by the range of the larger angle, for groups of orders."""
    lines = []
    for title, belongs in _groups().items():
        if not (chosen := [row for row in rows if belongs(row)]):
            continue
        names = list(chosen[0].scalar)
        lines += ["", title, f"{'degrees':<9}" + "".join(f"{name:>22}" for name in names)]
        for low, high in RANGES_DEG:
            within = [row for row in chosen if low <= row.larger_angle_deg < high]
            if within:
                cells = "".join(f"{_spread(within, name):>22}" for name in names)
                lines.append(f"{low:>2} - {high:<4}{cells}{len(within):>6}")
    return "\n".join(lines[1:])


def rim_by_depth(rows: Sequence[Row]) -> str:
    """First orders of keratin in the plane at 60 to 75 degrees: median (90th percentile) by depth and profile."""
    lines = [
        "first orders in the plane, 60 to 75 degrees, by depth",
        f"{'depth':<7}{'profile':<14}" + "".join(f"{name:>22}" for name in _FORMS),
    ]
    found = [
        row for row in rows
        if abs(row.order) == 1 and _is_keratin(row.case) and row.case.azimuth_deg == 0
        and 60 <= row.larger_angle_deg < 75
    ]  # fmt: skip
    for depth, kind in product(DEPTHS, ("all", *PROFILES)):
        within = [row for row in found if row.case.depth == depth and kind in ("all", row.case.kind)]
        if within:
            cells = "".join(f"{_spread(within, name):>22}" for name in _FORMS)
            lines.append(f"{depth:<7g}{kind:<14}{cells}{len(within):>6}")
    return "\n".join(lines)


def sums(totals: Sequence[Total]) -> str:
    """The light of all orders over a flat surface's, by the angle of the light, and its distance from RCWA."""
    lines = [
        "light of all orders over a flat surface's: least to most, mean; the largest difference from RCWA as a "
        "fraction of the flat surface's light, and of the incident light"
    ]
    groups = [("keratin", depth) for depth in SUM_DEPTHS] + [(name, SHALLOW[-1]) for name in (*METALS, *FILMS)]
    for name, deepest in groups:
        belongs = _is_keratin if name == "keratin" else lambda case, name=name: is_of(case, name)
        chosen = [one for one in totals if one.case.depth <= deepest and belongs(one.case)]
        forms = [form for form in (*_FORMS, RATIO) if chosen and form in chosen[0].scalar]
        heads = "".join(f"{head:>32}" for head in ("RCWA", *forms))
        lines += ["", f"{name}, depth to {deepest:g}", f"{'light at':<10}{heads}"]
        for theta in SUM_ANGLES_DEG:
            if within := [one for one in chosen if one.case.theta_deg == theta]:
                cells = [_sum_cell(within, [one.rigorous for one in within])]
                cells += [_sum_cell(within, [one.scalar[form] for one in within]) for form in forms]
                lines.append(f"{theta:<10g}" + "".join(f"{cell:>32}" for cell in cells) + f"{len(within):>6}")
        lines += [_within(chosen, form) for form in forms]
    return "\n".join(lines)


def _within(totals: Sequence[Total], form: str) -> str:
    """How often a form's light of all orders is within NEAR of RCWA's."""
    away = np.array([abs(one.scalar[form] - one.rigorous) for one in totals])
    of_flat = np.mean(away <= NEAR * np.array([one.flat for one in totals]))
    return (
        f"{form}: within {NEAR:g} of RCWA in {of_flat:.0%} of {len(totals)} cases as a fraction of the flat surface's "
        f"light, in {np.mean(away <= NEAR):.1%} of the incident light (largest {away.max():.3f})"
    )


def _sum_cell(totals: Sequence[Total], light: Sequence[float]) -> str:
    flat = np.array([one.flat for one in totals])
    away = np.abs(np.array(light) - [one.rigorous for one in totals])
    share = np.array(light) / flat
    told = f"{share.min():.2f}-{share.max():.2f}, {share.mean():.2f}"
    return f"{told}; {(away / flat).max():.3f}, {away.max():.3f}" if away.any() else told


def largest_sums(title: str, measured: Sequence[Grating]) -> str:
    """The largest light of all orders by index and form, without RCWA: over a flat surface's, and of the incident."""
    lines = [f"largest light of all orders, without RCWA, {title}"]
    for (name, index), form in product(INDICES.items(), _FORMS):
        over_flat, of_incident = (0.0, ""), (0.0, "")
        for case in (replace(each, index=index) for each in measured):
            total = sum(light[form] for _, _, light in scalar_orders(case))
            where = f"{case.kind}, period {case.period:g}, depth {case.depth:g}, light at {case.theta_deg:g}"
            over_flat = max(over_flat, (total / flat_reflectance(case), where))
            of_incident = max(of_incident, (total, where))
        told = f"{over_flat[0]:.2f} of a flat surface's ({over_flat[1]})"
        lines.append(f"{name}, {form}: {told}; {of_incident[0]:.2f} of the incident light ({of_incident[1]})")
    return "\n".join(lines)


def convergence(*, quick: bool = False) -> str:
    """What finer RCWA changes of a first order in metals and under films: median and largest relative change."""
    lines = ["what finer RCWA changes of a first order, median (largest)"]
    settings = ((1.5, 40.0),) if quick else ((1.5, 40.0), (2.5, 60.0))
    kinds = ("binary",) if quick else PROFILES  # the others have many slices
    surfaces = {name: (index, ()) for name, index in METALS.items()} | {name: films_of(name)[0] for name in FILMS}
    for name, (index, films) in surfaces.items():
        for depth in SHALLOW[:1] if quick else SHALLOW:
            orders_changed, parts_changed = [], []
            for kind, (period, theta) in product(kinds, settings):
                case = Grating(kind, period, depth, theta, index=index, films=films)
                extra = extra_orders(case)
                usual = rigorous_orders(case, 1, extra=extra)[::2]
                there = usual >= LEAST
                finer = (
                    rigorous_orders(case, 1, extra=2 * extra)[::2],
                    rigorous_orders(case, 1, extra=extra, parts=2 * PARTS)[::2],
                )
                for changed, one in zip((orders_changed, parts_changed), finer, strict=True):
                    changed.extend(np.abs(one[there] / usual[there] - 1))
            lines.append(f"{name}, depth {depth:g}: {_change(orders_changed)} with twice the extra orders, "
                         f"{_change(parts_changed)} with twice the parts")  # fmt: skip
    return "\n".join(lines)


def _change(changes: Sequence[float]) -> str:
    return f"{100 * np.median(changes):.1f} % ({100 * max(changes):.1f} %)"


def _spread(rows: Sequence[Row], name: str) -> str:
    return _told(off_by(rows, name))


def _told(off: np.ndarray) -> str:
    return f"{np.median(off):.2f} ({np.quantile(off, 0.9, method='higher'):.2f})"


_FORMS = {"Stam": "Stam's form", "small slope": "small slope form (the materials)"}
_ANGLES = {"light and view within 60 degrees of the normal": (0, 60), "light or view at 60 to 90 degrees": (60, 90)}
# The colour scale ends here; a larger factor has the last colour.
_WORST = 2.0


def main(argv: list[str] | None = None) -> None:
    """Print the tables; write the picture if asked for."""
    parser = OneLineParser(prog="./dev bench rcwa_orders", description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few periods, depths and angles")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="draw first orders by depth and period")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    if importlib.util.find_spec("inkstone") is None:
        sys.exit("error: inkstone is not here; remedy: ./dev bench rcwa_orders, in the environment py311-bpy45")
    chosen = cases(quick=arguments.quick)
    measured = [measure(case) for case in chosen]
    rows = kept(row for orders, _ in measured for row in orders)
    totals = [total for _, total in measured]
    parts = [order_table(rows), rim_by_depth(rows), sums(totals)]
    within = [case for case in chosen if not (case.azimuth_deg or holds_reflectance(case))]
    parts += [largest_sums("the same gratings in the plane", within), largest_sums("steep ones", steep())]
    parts += [convergence(quick=arguments.quick)]
    report.say("\n\n".join(parts), arguments.json)
    if arguments.picture:
        draw(arguments.picture, rows)
    facts = {"rows": [_record(row) for row in rows], "totals": [_record(total) for total in totals]}
    report.write(facts, arguments.json)


def _record(one: Row | Total) -> dict:
    """A row or a total for JSON, which has no complex numbers."""
    facts = asdict(one)
    facts["case"]["index"] = _parts(facts["case"]["index"])
    facts["case"]["films"] = [(_parts(index), thickness) for index, thickness in facts["case"]["films"]]
    return facts


def _parts(index: complex) -> list[float]:
    return [complex(index).real, complex(index).imag]


def draw(path: Path, rows: Sequence[Row]) -> None:
    """Write a picture with a panel for each form and range of angles: the median factor, at least 1, in each cell.

    Raises GratingError if matplotlib is not installed."""
    pyplot = plots.pyplot()
    first = [row for row in rows if abs(row.order) == 1 and not holds_reflectance(row.case)]
    depths = sorted({row.case.depth for row in first})
    periods = sorted({row.case.period for row in first})
    figure, panels = pyplot.subplots(2, 2, figsize=(8, 6), sharex=True, sharey=True, layout="constrained")
    for (title, (low, high)), line in zip(_ANGLES.items(), panels, strict=True):
        for (form, name), panel in zip(_FORMS.items(), line, strict=True):
            chosen = [row for row in first if low <= row.larger_angle_deg < high]
            factor = _medians(chosen, form, depths, periods)
            shown = panel.imshow(factor, cmap="YlOrRd", vmin=1, vmax=_WORST, origin="lower", aspect="auto")
            for (i, j), one in np.ndenumerate(factor):
                if np.isfinite(one):
                    colour = "w" if one > 1.6 else "k"
                    panel.text(j, i, f"{one:.2f}", ha="center", va="center", fontsize=9, color=colour)
            panel.set_title(f"{name}\n{title}", fontsize=8)
            panel.set_xticks(range(len(periods)), [f"{one:g}" for one in periods])
            panel.set_yticks(range(len(depths)), [f"{one:g}" for one in depths])
    figure.supxlabel("period, in wavelengths", fontsize=10)
    figure.supylabel("depth from trough to crest, in wavelengths", fontsize=10)
    bar = figure.colorbar(shown, ax=panels, extend="max", shrink=0.7)
    bar.set_label("first orders are too bright or too dark by this factor (median)", fontsize=9)
    _write(path, figure)


def _write(path: Path, figure: Any) -> None:
    """Write a figure as a small PNG file and close it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    drawn = io.BytesIO()
    figure.savefig(drawn, dpi=100)
    plots.pyplot().close(figure)
    # A palette halves the file.
    small = Image.open(drawn).convert("RGB").quantize(96, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    write_whole(path, lambda partial: small.save(partial, "PNG", optimize=True))


def _medians(rows: Sequence[Row], form: str, depths: Sequence[float], periods: Sequence[float]) -> np.ndarray:
    """The median factor (depths, periods); NaN without an order."""
    found = np.full((len(depths), len(periods)), np.nan)
    for i, depth in enumerate(depths):
        for j, period in enumerate(periods):
            here = [row for row in rows if (row.case.depth, row.case.period) == (depth, period)]
            if here:
                found[i, j] = np.median(off_by(here, form))
    return found
