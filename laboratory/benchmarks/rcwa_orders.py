# SPDX-License-Identifier: GPL-3.0-or-later
"""How far single orders, and the light of all orders, are from Maxwell's equations, by five factors of the spectrum.

    ./dev bench rcwa_orders [--quick] [--picture FILE] [--json FILE|-]

rcwa_orders_rows.py has the gratings, rcwa_orders_factors.py the factors, rcwa_orders_tables.py the tables. The tables
of single orders leave out orders of less than LEAST of the light: RCWA's own error is about that large. `--picture`
draws how far the first orders of keratin are off, by depth and period.
"""

import importlib.util
import io
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from precompute.base.files import write_whole
from precompute.cli.parser import OneLineParser

from ..study import plots
from . import rcwa_orders_tables as tables
from . import report
from .rcwa_orders_rows import Row, Total, cases, holds_reflectance, measure, off_by, steep

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
    rows = tables.kept(row for orders, _ in measured for row in orders)
    totals = [total for _, total in measured]
    parts = [tables.orders(rows), tables.rim_by_depth(rows), tables.sums(totals)]
    within = [case for case in chosen if not (case.azimuth_deg or holds_reflectance(case))]
    parts += [tables.largest_sums("the same gratings in the plane", within), tables.largest_sums("steep ones", steep())]
    parts += [tables.convergence(quick=arguments.quick)]
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
