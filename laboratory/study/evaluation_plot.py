# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots an evaluation, one panel for each method."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from . import plots
from .evaluation import Evaluation


def plot(path: Path, evaluations: Sequence[Evaluation], title: str = "") -> None:
    """Write a plot with one panel for each method: response, peaks, and the curve of the grating equation.

    Raises GratingError if matplotlib is not installed."""
    pyplot = plots.pyplot()
    columns = min(4, len(evaluations))
    rows = -(-len(evaluations) // columns)
    size = (3.3 * columns + 0.6, 2.9 * rows + 0.5)
    figure, panels = pyplot.subplots(rows, columns, figsize=size, sharey=True, squeeze=False, layout="constrained")
    for panel in panels.flat[len(evaluations) :]:
        panel.set_axis_off()
    for panel, one in zip(panels.flat, evaluations, strict=False):
        nm = one.lambdas_m * 1e9
        # The square root shows faint flanks. Each panel has its own brightness scale.
        panel.pcolormesh(nm, np.degrees(one.plane.theta_v), np.sqrt(one.response).T, rasterized=True, cmap="viridis")
        panel.plot(nm, np.degrees(one.peak_angles), "r-", linewidth=2, label="peaks")
        panel.plot(nm, np.degrees(one.expected_angles), "w--", linewidth=1, label="grating equation")
        told = one.as_dict()
        mean, variance = told["period_mean_nm"], told["period_variance_nm"]
        panel.set_title(f"{one.name}: {mean:.2f} nm, variance {variance:.3g}", fontsize=9)
    panels[0, 0].legend(loc="lower right", fontsize=8, facecolor="0.5")
    figure.supxlabel("wavelength, nm", fontsize=9)
    figure.supylabel("viewing angle, degrees", fontsize=9)
    figure.suptitle(title, fontsize=10)
    figure.savefig(path, dpi=80)
    pyplot.close(figure)
