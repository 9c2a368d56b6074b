# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws direction pairs and computes the reference's colours on them (docs/theory.md, "The error metric").

The pairs come in groups of equal w. Half of a group is cosine weighted. Half is drawn from the reference's spectrum,
because random directions rarely hit a narrow diffraction order. errors.py measures a candidate on these pairs.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.progress import Progress, part_of, silent
from ..colour.observer import spectral_weights, wavelengths
from ..reference.reference import reference_grid, reference_xyz
from ..spectra.spectrum import FrequencyGrid, scattered_spectrum
from ..surface.relief import Relief
from .errors import Pairs, Truth, cosine_weighted, draw_w, pair_about


@dataclass(frozen=True)
class Binned:
    """The power in the bins of a grid: the sums of its rows (ny,), and a function that returns one row (nx,).

    Only a few rows are drawn, so a spectrum need not be made in all bins."""

    grid: FrequencyGrid
    row_sums: np.ndarray
    row: Callable[[int], np.ndarray]


# spectrum(s in cycles per metre).
Spectrum = Callable[[float], Binned]


def binned(power: np.ndarray, grid: FrequencyGrid) -> Binned:
    """The power (ny, nx) in the bins of a grid."""
    return Binned(grid, power.sum(axis=1, dtype=float), lambda row: power[row])


def exact_spectrum(relief: Relief, grid: FrequencyGrid) -> Spectrum:
    """The spectrum of a relief, by one transform for each s."""
    return lambda s: binned(scattered_spectrum(relief, s, grid)[0], grid)


def draw_pairs(
    spectrum: Spectrum, sigma_b: float, w: float, *, count: int, rng: np.random.Generator,
    line_m: float | None = None, least: float = 0.0,
) -> Pairs:  # fmt: skip
    """Draw `count` pairs with cos(ti) + cos(tr) = w: half cosine weighted, half from the spectrum under a kernel of
    sigma_b. Fewer pairs are returned if the spectrum is dark or lies mostly past the horizon.

    `line_m` is the wavelength in metres of a laser's line. Both cosines are at least `least`."""
    cosine = cosine_weighted(w, count // 2, rng, least=least)
    half = _half_vectors(spectrum, sigma_b, w, count - count // 2, rng, line_m)
    spectral = pair_about(half, rng, least=least)
    wi, wr = (np.concatenate(halves) for halves in zip(cosine, spectral, strict=True))
    drawn = np.arange(len(wi)) >= len(cosine[0])
    return Pairs(wi, wr, drawn)


def _half_vectors(
    spectrum: Spectrum, sigma_b: float, w: float, count: int, rng: np.random.Generator, line_m: float | None
) -> np.ndarray:
    """Draw half vectors (n, 3) from the scattered power times luminance, blurred by the kernel."""
    lambdas = wavelengths(20e-9) if line_m is None else np.array([line_m])
    luminance = spectral_weights(lambdas)[:, 1]
    half = []
    # Four times `count` are drawn, because half vectors past the horizon are discarded.
    for lam, share in zip(lambdas, rng.multinomial(4 * count, luminance / luminance.sum()), strict=True):
        if share == 0:
            continue
        power = spectrum(w / lam)
        cumulative = np.cumsum(np.maximum(power.row_sums, 0))
        if cumulative[-1] <= 0:
            continue
        row, col = _drawn_bins(power.row, cumulative, rng.random(share) * cumulative[-1])
        q = np.stack([power.grid.q_x[col], power.grid.q_y[row]], axis=-1)
        half.append(lam * q + sigma_b * rng.standard_normal((share, 2)))
    if not half:
        return np.empty((0, 3))
    uv = rng.permutation(np.concatenate(half))
    uv = uv[np.sum(uv**2, axis=1) < 4 - w**2][:count]
    return np.column_stack([uv, np.full(len(uv), w)])


def _drawn_bins(
    row_of: Callable[[int], np.ndarray], cumulative: np.ndarray, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The rows and columns (n,) of the bins (ny, nx) at which the power, summed row by row, reaches the sums `at` (n,).
    `cumulative` is the sum up to the end of each row. Only rows that are drawn are summed bin by bin."""
    row = np.minimum(np.searchsorted(cumulative, at), len(cumulative) - 1)
    before = np.where(row > 0, cumulative[row - 1], 0.0)
    share = (at - before) / (cumulative[row] - before)
    column = np.empty(len(at), int)
    for one in np.unique(row):
        along, drawn = np.cumsum(np.maximum(row_of(one), 0), dtype=float), row == one
        column[drawn] = np.minimum(np.searchsorted(along, share[drawn] * along[-1]), len(along) - 1)
    return row, column


def truths(
    relief: Relief, sigma_b: float, w_count: int, *, pairs_each: int, step_m: float,    seed: int = 0,
    progress: Progress = silent,
) -> list[Truth]:  # fmt: skip
    """The reference at w_count random values of w, with up to pairs_each direction pairs each, every step_m metres."""
    rng = np.random.default_rng(seed)
    grid = reference_grid(relief, sigma_b)
    found = []
    for k, w in enumerate(draw_w(w_count, rng)):
        pairs = draw_pairs(exact_spectrum(relief, grid), sigma_b, w, count=pairs_each, rng=rng)
        told = part_of(progress, "reference", done=k, total=w_count)
        colours = reference_xyz(relief, (pairs.u, pairs.v), w=w, sigma_b=sigma_b, step_m=step_m, progress=told)
        found.append(Truth(w, pairs, *colours))
    return found
