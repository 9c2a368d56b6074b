# SPDX-License-Identifier: GPL-3.0-or-later
"""The rows of docs/evaluation.md's tables of periods."""

from dataclasses import dataclass, replace

import numpy as np

from precompute.colour.observer import wavelengths
from precompute.methods.method_registry import METHODS
from precompute.surface.height_map import HeightMap
from precompute.surface.quality import grating_period
from precompute.surface.relief import Relief, prepare
from precompute.surface.samples.ruled_gratings import blazed

from ..study import evaluation
from ..study.response import WINDOW, FirstOrder, first_order_plane, response
from ..study.traits import DEFAULT_METHODS
from .evaluation_maps import as_the_thesis_cuts

THETA_I = np.radians(75)
# The thesis's own periods of the skins.
THESIS_PERIODS_M = {"elaphe": 1144.26e-9, "xenopeltis": 1552.27e-9}


@dataclass(frozen=True)
class Row:
    """One line of a table: an evaluation, and the mean and variance in nm that the thesis gives, if it does."""

    label: str
    evaluation: evaluation.Evaluation
    thesis: str = ""


def blaze_rows(surface: HeightMap) -> list[Row]:
    """The rows of the blaze: every method, and FLSS with light from the other side."""
    thesis = {"flss": "2499.997 / 0.377", "nmm": "2499.997 / 0.377"}
    relief, other = prepare(surface), prepare(evaluation.turned(surface, 0))
    settings, first_order = evaluation.thesis_settings(period_m=2.5e-6), FirstOrder(THETA_I, 2.5e-6)
    rows = [
        Row(name, evaluation.evaluate_method(name, relief, settings, first_order=first_order), thesis.get(name, ""))
        for name in DEFAULT_METHODS
    ]
    texels = replace(settings, texels=21)
    rows += [
        Row(
            "pq, 21 x 21 texels",
            evaluation.evaluate_method("pq", prepare(blazed(rows=64)), texels, first_order=first_order),
            "2502.428 / 0.390",
        ),
        Row("flss, light from +T", evaluation.evaluate_method("flss", other, settings, first_order=first_order)),
    ]
    return rows  # fmt: skip


def elaphe_rows(surface: HeightMap) -> list[Row]:
    """The rows of Elaphe: every method, then variations.

    The variations show how the period depends on the speckle of one patch and on the way the patch is cut out."""
    relief, other = prepare(surface), prepare(evaluation.turned(surface, 0))
    cut = as_the_thesis_cuts(evaluation.turned(surface, 0))
    period_m, given_m = grating_period(relief), THESIS_PERIODS_M["elaphe"]
    return [
        *(_row(name, name, relief, period_m) for name in DEFAULT_METHODS),
        _row("nmm, given 1144.26 nm", "nmm", relief, given_m),
        _row("flss, light from +T", "flss", other, period_m),
        _row("flss, cut as the thesis, from +T", "flss", cut, given_m, "1144.262 / 0.401"),
        _row("nmm, cut as the thesis, from +T", "nmm", cut, given_m, "1144.179 / 0.677"),
        _row("pq-printed, cut as the thesis, from +T", "pq-printed", cut, given_m, "1052.308 / 49.7"),
        _row("pq, cut as the thesis, from +T", "pq", cut, given_m),
        _row("reference, 30 areas", "reference", relief, period_m, coherence_length_m=None),
        _row("reference, 30 areas, from +T", "reference", other, period_m, coherence_length_m=None),
    ]


def xenopeltis_rows(surface: HeightMap) -> list[Row]:
    """The rows of Xenopeltis: every method in the plane along the fingers, then variations.

    The Taylor series is summed in float64, because float32 leaves it no digits at 819 nm of relief. Its heights count
    from the middle, which halves the number of its terms."""
    period_m, thesis = THESIS_PERIODS_M["xenopeltis"], "1552.27 / 0.45"
    relief, other = (prepare(evaluation.turned(surface, azimuth)) for azimuth in (90, 270))
    cut, other_cut = (as_the_thesis_cuts(evaluation.turned(surface, azimuth)) for azimuth in (90, 270))

    def row(label: str, name: str, what: Relief, **changes) -> Row:
        told = thesis if name == "flss" else ""
        return _row(label, name, what, period_m, told, **{"dtype": np.float64, "centred": True, **changes})

    return [
        *(row(name, name, relief) for name in DEFAULT_METHODS if name != "stam"),
        row("flss, light from -B", "flss", other),
        row("flss, cut as the thesis, from +B", "flss", cut),
        row("flss, cut as the thesis, from -B", "flss", other_cut),
        row("reference, 30 areas", "reference", relief, coherence_length_m=None),
        row("reference, 30 areas, from -B", "reference", other, coherence_length_m=None),
    ]


def _row(label: str, name: str, relief: Relief, period_m: float, thesis: str = "", **changes) -> Row:
    """A method under the thesis's settings and these changes, given a period and evaluated around it."""
    settings, first_order = evaluation.thesis_settings(period_m=period_m, **changes), FirstOrder(THETA_I, period_m)
    return Row(label, evaluation.evaluate_method(name, relief, settings, first_order=first_order), thesis)


def grid_variance(surface: HeightMap, step_deg: float) -> float:
    """Variance of the period in square nanometres on the blaze when each peak is the highest sample of a grid of
    angles.

    The thesis takes its peaks so."""
    relief, lambdas = prepare(surface), wavelengths(5e-9)
    plane = first_order_plane(THETA_I, lambdas, 2.5e-6, step=np.radians(step_deg))
    method = METHODS["chebyshev"](relief, evaluation.thesis_settings())
    order = np.abs(plane.u) * 2.5e-6 / lambdas[:, None]
    found = response(method, plane, lambdas) * (np.abs(order - 1) < WINDOW)
    return float(np.var(lambdas / np.abs(plane.u[found.argmax(axis=1)]) * 1e9))


def patch_spread(surface: HeightMap, around_m: float, parts: int = 3) -> list[float]:
    """The periods in nanometres that FLSS over Chebyshev images finds in each of parts x parts pieces of a scan, around
    a period in metres.

    Each piece is 65 / parts um long."""
    rows, cols = (n // parts for n in surface.height_m.shape)
    found = []
    for k in range(parts * parts):
        y, x = (k // parts) * rows, (k % parts) * cols
        piece = replace(surface, height_m=surface.height_m[y : y + rows, x : x + cols], periodic=False)
        relief = prepare(piece)
        settings = evaluation.thesis_settings(coherence_length_m=relief.size_m[1])
        one = evaluation.evaluate_method("chebyshev", relief, settings, first_order=FirstOrder(THETA_I, around_m))
        found.append(one.as_dict()["period_mean_nm"])
    return found
