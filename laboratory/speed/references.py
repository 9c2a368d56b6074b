# SPDX-License-Identifier: GPL-3.0-or-later
"""The exact colours that the benchmark judges each method against, one reference for each model of coherence."""

from dataclasses import dataclass

import numpy as np

from precompute.colour.observer import WAVELENGTH_MIN_M, spectral_weights, wavelengths
from precompute.measure.errors import Pairs, Truth, draw_w
from precompute.measure.truths import binned, draw_pairs, exact_spectrum
from precompute.methods import exact
from precompute.methods.method import Settings
from precompute.optics import coherence
from precompute.reference.reference import blurred, reference_grid
from precompute.spectra.series import SpectrumSeries, spectrum_series
from precompute.surface.relief import Relief

from ..study import evaluation
from ..study.response import Plane, first_order_plane, response
from .surfaces import Effort, Surface

THETA_I = np.radians(75)
# Pairs within this many sigma_b of the zero order are left out.
ZERO_ORDER_REACH = 8.0
# Tolerance of the interpolation in s of the ensemble's spectra; a test holds it against the direct sums.
_EXACT = 1e-10
_WHOLE = (slice(None), slice(None))


def ensemble_truths(
    series: SpectrumSeries, sigma_b: float, w_count: int, *, pairs: int, lambdas: np.ndarray
) -> list[Truth]:
    """As measure.truths.truths, for `pairs` direction pairs at each of w_count random w, without the zero order.

    The spectra are interpolated in s between those of exact_series, which replaces a transform for every pair of w and
    wavelength."""
    rng = np.random.default_rng(0)
    found = []
    for w in draw_w(w_count, rng):

        def spectrum(s: float):
            return binned(_power(series, s), series.grid)

        drawn = draw_pairs(spectrum, sigma_b, w, count=pairs, rng=rng)
        drawn = away_from_zero_order(drawn, sigma_b)
        found.append(
            Truth(w, drawn, ensemble_xyz(series, sigma_b, drawn.u, v=drawn.v, w=w, lambdas=lambdas), np.zeros(3))
        )
    return found


def exact_series(relief: Relief, sigma_b: float) -> SpectrumSeries:
    """The spectrum of a relief at every s, to a tolerance of 1e-10."""
    return spectrum_series(relief, reference_grid(relief, sigma_b), 2 / WAVELENGTH_MIN_M, tolerance=_EXACT)


def ensemble_xyz(series: SpectrumSeries, sigma_b: float, u, *, v, w: float, lambdas: np.ndarray) -> np.ndarray:
    """Scattered XYZ (n, 3) at u, v (n,) and one w, summed over the bins that the kernel reaches."""
    xyz = np.zeros((len(u), 3))
    for lam, weight in zip(lambdas, spectral_weights(lambdas), strict=True):
        xyz += blurred(_power(series, w / lam), series.grid, (u, v), lam=lam, sigma_b=sigma_b)[:, None] * weight
    return xyz


def _power(series: SpectrumSeries, s: float) -> np.ndarray:
    return series.mixed(series.weights(np.array([s])) * s**2, _WHOLE)[:, 0]


def patch_truths(relief: Relief, length_m: float, w_count: int, *, pairs: int, step_m: float) -> list[Truth]:
    """As ensemble_truths, by the patch model's direct sums for a coherence length of length_m.

    They are slow: each pair of w and wavelength has a phasor of its own."""
    rng = np.random.default_rng(0)
    sigma_b = coherence.kernel_sigma(length_m)
    grid = reference_grid(relief, sigma_b)
    reference = exact.build_patch(relief, Settings(coherence_length_m=length_m, step_m=step_m))
    found = []
    for w in draw_w(w_count, rng):
        drawn = draw_pairs(exact_spectrum(relief, grid), sigma_b, w, count=pairs, rng=rng)
        drawn = away_from_zero_order(drawn, sigma_b)
        found.append(Truth(w, drawn, reference.xyz(drawn.u, drawn.v, w), np.zeros(3)))
    return found


def away_from_zero_order(pairs: Pairs, sigma_b: float) -> Pairs:
    """The pairs that are more than ZERO_ORDER_REACH sigma_b away from the zero order."""
    kept = np.hypot(pairs.u, pairs.v) > ZERO_ORDER_REACH * sigma_b
    return pairs.only(kept)


@dataclass(frozen=True)
class Judge:
    """The reference of one surface under one model of coherence: pairs and their colours, the views of the first order,
    and the angle of the brightest of these in degrees. `series` is the ensemble's; the patch model has none."""

    truths: list[Truth]
    plane: Plane
    brightest_deg: float
    series: SpectrumSeries | None = None


def judges(surface: Surface, effort: Effort) -> dict[str, Judge]:
    """The judges of a surface, by model of coherence."""
    sigma_b = coherence.kernel_sigma(effort.coherence_m)
    step_m = effort.reference_nm * 1e-9
    plane = first_order_plane(THETA_I, wavelengths(5e-9), surface.period_m)
    settings = Settings(coherence_length_m=effort.coherence_m)
    series = exact_series(surface.whole, sigma_b)
    truths = {
        "ensemble": ensemble_truths(series, sigma_b, effort.w_count, pairs=effort.pairs, lambdas=wavelengths(step_m)),
        "patch": patch_truths(
            surface.patch, effort.coherence_m, effort.w_count, pairs=effort.patch_pairs, step_m=step_m
        ),
    }
    found, lambdas = {}, wavelengths(2.5e-9)
    references = {
        "ensemble": exact.build_ensemble(surface.whole, settings),
        "patch": exact.build_patch(surface.patch, settings),
    }
    for model, reference in references.items():
        luminance = response(reference, plane, lambdas).T @ spectral_weights(lambdas)[:, 1]
        brightest = evaluation.peak(np.degrees(plane.theta_v), luminance)
        found[model] = Judge(truths[model], plane, brightest, series if model == "ensemble" else None)
    return found
