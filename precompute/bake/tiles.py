# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the tiles of a plan's table.

For each wavelength, the spectrum at each node of w is blurred by the kernel and resampled onto (u, v). The kernel is a
product of factors along u and v with a fixed size in (u, v), so this takes two products with banded matrices. Between
wavelengths only the bins' places in (u, v) change. The results are weighted by the observer and summed over the
wavelengths. A cosine transform over the nodes of w then gives the terms B_k. Several scans of one skin are averaged,
which is exact because every step is linear in the spectrum.
"""

import math

import numpy as np

from ..base.progress import Progress, silent
from ..colour.channels import channel_weights
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, seen_wavelengths
from ..maths import chebyshev
from ..reflectance.curves import reflectance_at
from ..spectra.resample import Resampler
from ..table.table import ZERO_ORDER_SAMPLES, Table
from .blur_levels import narrower
from .plan import Plan
from .trapped_light import plate_gains

# Number of texels past |(u, v)| = 2 that are kept. A reading at |(u, v)| = 2 uses texels less than two texels away
# along each axis, so less than 2.9 texels away in all.
_RIM = 3
# Number of wavelengths, and of rows of the table, that are summed at once, to fit into a core's cache.
_WAVELENGTHS_AT_ONCE, _ROWS_AT_ONCE = 8, 16
# Number of bins that are mixed at once, over several nodes: 32 MiB of floats.
_BINS_AT_ONCE = 1 << 23


def carry_out(chosen: Plan, illuminant: str = "D65", progress: Progress = silent) -> Table:
    """Make the table of a plan, without wider blur levels. `progress` is called with the share of the table."""
    sigma_table = narrower(chosen.sigma_b, chosen.texel)
    nodes = chebyshev.nodes(chosen.terms, *chosen.w_range)
    at_nodes = channels_over_w2(chosen, nodes, sigma_table, illuminant=illuminant, progress=progress)
    to_terms = chebyshev.coefficients_from_nodes(chosen.terms).astype(np.float32)
    terms = np.tensordot(to_terms, at_nodes, axes=1)
    v, u = chosen.axes
    terms[:, v[:, None] ** 2 + u**2 > (2 + _RIM * chosen.texel) ** 2] = 0
    zero_order = zero_order_curve(chosen, illuminant)
    gains = None
    if chosen.matter.has_plate:
        gains = plate_gains(chosen.ensemble, chosen.sigma_b, matter=chosen.matter, illuminant=illuminant)
    return Table(
        terms, zero_order, chosen.sigma_b, chosen.texel, illuminant, chosen.matter.ratio_ior, (v[0], u[0]),
        chosen.w_range, chosen.precision, plate_ior=chosen.matter.plate_ior, largest_albedo=chosen.largest_albedo,
        gains=gains,
    )  # fmt: skip


def zero_order_curve(chosen: Plan, illuminant: str) -> np.ndarray:
    """The channels of Z (n, channels), at equal steps of w from 0 to 2, times the reflectance of a matter that the
    table holds, over the largest albedo."""
    lambdas = seen_wavelengths(np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, 401), illuminant)
    w = np.linspace(0, 2, ZERO_ORDER_SAMPLES)
    efficiency = sum(series.zero_order(w[:, None] / lambdas) for series in chosen.ensemble) / len(chosen.ensemble)
    if chosen.holds_reflectance:
        efficiency = efficiency * chosen.matter.reflectance(lambdas, w / 2).T
    return efficiency @ channel_weights(lambdas, illuminant) / chosen.largest_albedo


def channels_over_w2(
    chosen: Plan, w_nodes: np.ndarray, sigma: float, *, illuminant: str, progress: Progress = silent
) -> np.ndarray:
    """Channels over w^2 (K, rows, columns, channels) float32 of the scattered light, at nodes of w (K,) and the plan's
    texels.

    `sigma` is the standard deviation of the sampled kernel. `progress` is called after each group of wavelengths."""
    v, u = chosen.axes
    lambdas = chosen.wavelengths
    over = len(chosen.ensemble) * chosen.largest_albedo
    weights = (channel_weights(lambdas, illuminant) / over).astype(np.float32)
    out = np.zeros((len(w_nodes), len(v), weights.shape[1], len(u)), np.float32)
    radius = 2 + _RIM * chosen.texel
    reflectance = reflectance_at(chosen.matter, lambdas, (u, v[:, None], w_nodes[:, None, None]))
    images = np.zeros((len(w_nodes), len(v), _WAVELENGTHS_AT_ONCE, len(u)), np.float32)
    done = 0
    for series in chosen.ensemble:
        for start in range(0, len(lambdas), _WAVELENGTHS_AT_ONCE):
            group = slice(start, min(start + _WAVELENGTHS_AT_ONCE, len(lambdas)))
            for g, lam in enumerate(lambdas[group]):
                resample = Resampler(series.grid, u, v, lam, series.kernel_left(sigma, lam), radius)
                mix = series.weights(w_nodes / lam) / lam**2
                bins = math.prod(kept.stop - kept.start for kept in resample.kept)
                at_once = max(1, _BINS_AT_ONCE // max(bins, 1))
                for first in range(0, len(mix), at_once):
                    spectra = series.mixed(mix[first : first + at_once], resample.kept)
                    for k in range(spectra.shape[1]):
                        resample(spectra[:, k], out=images[first + k, :, g])
                if chosen.holds_reflectance:
                    images[:, :, g] *= reflectance(start + g)
            count = group.stop - group.start
            for tile, image in zip(out, images, strict=True):
                for row in range(0, len(v), _ROWS_AT_ONCE):
                    rows = slice(row, row + _ROWS_AT_ONCE)
                    tile[rows] += weights[group].T @ image[rows, :count]
            done += count
            progress("wavelengths", done / (len(lambdas) * len(chosen.ensemble)))
    return np.moveaxis(out, 2, -1)
