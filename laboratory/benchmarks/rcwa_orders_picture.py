# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws how far first orders of keratin are from Maxwell's equations, by depth and period."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from precompute.base.files import write_whole

from ..study import plots
from .rcwa_orders_rows import Row, holds_reflectance, off_by

_FORMS = {"Stam": "Stam's form", "small slope": "small slope form (the materials)"}
_ANGLES = {"light and view within 60 degrees of the normal": (0, 60), "light or view at 60 to 90 degrees": (60, 90)}
# The colour scale ends here; a larger factor has the last colour.
_WORST = 2.0


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
    path.parent.mkdir(parents=True, exist_ok=True)
    drawn = io.BytesIO()
    figure.savefig(drawn, dpi=100)
    pyplot.close(figure)
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
