# SPDX-License-Identifier: GPL-3.0-or-later
"""The exact colours that the benchmark judges each method against, one reference for each model of coherence."""

from dataclasses import dataclass

import numpy as np

from ...colour.observer import WAVELENGTH_MIN_M, spectral_weights, wavelengths
from ...measure.errors import Truth
from ...measure.pairs import Pairs, draw_w
from ...measure.truths import draw_pairs
from ...methods.method import Settings
from ...methods.registry import METHODS
from ...optics import coherence
from ...reference.ensemble import blurred, reference_grid
from ...spectra.series import spectrum_series
from ...spectra.spectrum import scattered_spectrum
from ...surface.relief import Relief
from .. import evaluation
from ..response import Plane, first_order_plane, response
from .surfaces import Effort, Surface

THETA_I = np.radians(75)


# Pairs nearer to the zero order than this many sigma_b are left to the zero order's own figure.
ZERO_ORDER_REACH = 8.0


# Interpolation of the ensemble reference's spectra in s, as evaluation's; a test holds it against the direct sums.
_EXACT = 1e-10


_WHOLE = (slice(None), slice(None))


# The references


def ensemble_truths(relief: Relief, sigma_b: float, w_count: int, pairs: int, lambdas, series=None):
    """As metric.truths, the spectra interpolated in s to 1e-10: one transform a node, not one a wavelength and w."""
    rng = np.random.default_rng(0)
    series = series or exact_series(relief, sigma_b)
    found = []
    for w in draw_w(w_count, rng):

        def spectrum(s: float):
            return _power(series, s), series.grid

        drawn = draw_pairs(spectrum, sigma_b, w, pairs, rng)
        drawn = away_from_zero_order(drawn, sigma_b)
        found.append(Truth(w, drawn, ensemble_xyz(series, sigma_b, drawn.u, drawn.v, w, lambdas), np.zeros(3)))
    return found


def exact_series(relief: Relief, sigma_b: float):
    """The spectrum of a relief at every s, to 1e-10."""
    return spectrum_series(relief, reference_grid(relief, sigma_b), 2 / WAVELENGTH_MIN_M, tolerance=_EXACT)


def ensemble_xyz(series, sigma_b: float, u, v, w: float, lambdas: np.ndarray) -> np.ndarray:
    """Scattered XYZ (n, 3) at one w, from the bins under the kernel."""
    xyz = np.zeros((len(u), 3))
    for lam, weight in zip(lambdas, spectral_weights(lambdas), strict=True):
        xyz += blurred(_power(series, w / lam), series.grid, u, v, lam, sigma_b)[:, None] * weight
    return xyz


def _power(series, s: float) -> np.ndarray:
    return series.mixed(series.weights(np.array([s])) * s**2, _WHOLE)[:, 0]


def patch_truths(relief: Relief, sigma_b: float, length_m: float, w_count: int, pairs: int, step_m: float):
    """metric.Truth by the patch model's direct sums; each w has one phasor a wavelength, so they are few."""
    rng = np.random.default_rng(0)
    grid = reference_grid(relief, sigma_b)
    reference = METHODS["reference-patch"](relief, Settings(coherence_length_m=length_m, step_m=step_m))
    found = []
    for w in draw_w(w_count, rng):
        drawn = draw_pairs(lambda s: (scattered_spectrum(relief, s, grid)[0], grid), sigma_b, w, pairs, rng)
        drawn = away_from_zero_order(drawn, sigma_b)
        found.append(Truth(w, drawn, reference.xyz(drawn.u, drawn.v, w), np.zeros(3)))
    return found


def away_from_zero_order(pairs: Pairs, sigma_b: float) -> Pairs:
    """The pairs that see nothing of the zero order."""
    kept = np.hypot(pairs.u, pairs.v) > ZERO_ORDER_REACH * sigma_b
    return Pairs(pairs.wi[kept], pairs.wr[kept], pairs.drawn[kept])


@dataclass(frozen=True)
class Judge:
    """The references of one surface under one model: pairs and their colours, and the angle of the brightest view."""

    truths: list[Truth]
    plane: Plane
    brightest_deg: float
    series: object = None


def judges(surface: Surface, effort: Effort) -> dict[str, Judge]:
    """By model of coherence."""
    sigma_b = coherence.kernel_sigma(effort.coherence_m)
    step_m = effort.reference_nm * 1e-9
    plane = first_order_plane(THETA_I, wavelengths(5e-9), surface.period_m)
    settings = Settings(coherence_length_m=effort.coherence_m)
    series = exact_series(surface.whole, sigma_b)
    truths = {
        "ensemble": ensemble_truths(surface.whole, sigma_b, effort.w_count, effort.pairs, wavelengths(step_m), series),
        "patch": patch_truths(surface.patch, sigma_b, effort.coherence_m, effort.w_count, effort.patch_pairs, step_m),
    }
    found, lambdas = {}, wavelengths(2.5e-9)
    for model, name, relief in (
        ("ensemble", "reference", surface.whole), ("patch", "reference-patch", surface.patch),
    ):  # fmt: skip
        density = response(METHODS[name](relief, settings), plane, lambdas)
        luminance = density.T @ spectral_weights(lambdas)[:, 1]
        brightest = evaluation.peak(np.degrees(plane.theta_v), luminance)
        found[model] = Judge(truths[model], plane, brightest, series if model == "ensemble" else None)
    return found
