# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the table that keeps a material from reflecting more than it receives.

Symbols as in directional_albedo.py. The albedo a(wi) exceeds 1 towards grazing light. Dividing f by

    M(wi, wr) = max(1, a(wi), a(wr))

keeps f reciprocal, and its albedo is then at most a(wi) / max(1, a(wi)). The table holds the excess E = A - cos(t), the
largest over all wavelengths, where A = a cos(t). So M = 1 + max(0, E(wi) / cos(ti), E(wr) / cos(tr)). E is smooth where
it crosses 0, so it is clamped only when it is read. A mirror has no excess.

table/direction_disc.py maps directions to the table. A cubic reading at a texel gives the exact excess. Between texels,
readings have an error of fourth order in the texels' distance, and of first order where the excess bends sharply:
within a few sigma_b of where a wrapping surface's order reaches the horizon at the first or last wavelength.
"""

from collections.abc import Sequence
from functools import reduce

import numpy as np

from ..base.progress import Progress, part_of, silent, span_of
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M
from ..maths import bspline
from ..spectra.series import SpectrumSeries
from ..table.albedo_bound import BOUND_TEXELS, albedo_bound
from ..table.direction_disc import place, texel_directions
from .directional_albedo import Orders, continuum_albedo, find_orders, orders_albedo, zero_order_albedo

# Number of wavelengths, equally spaced in their logarithm. As the wavelength grows, an order crosses the horizon, and
# shows in the albedo only while this logarithm grows by sigma_b / 2. So the orders of a surface that wraps are computed
# at every _STEP-th wavelength, then at all around the largest albedo. Other light is interpolated between every
# _STRIDE-th wavelength.
_WAVELENGTHS, _STEP, _STRIDE = 513, 4, 32
# A smaller excess counts as none. A spline through such a table would overshoot at the horizon.
_ROUNDING = 1e-6
# The shares of the progress after which the continuum and the tables of BOUND_TEXELS are done, for a surface whose
# orders are computed one by one. Few surfaces need the larger tables.
_DONE = (0.3, 0.8, 0.9, 1.0)
# Number of directions at which a table is compared with exact values.
_PROBES = 512


def excess_table(
    ensemble: Sequence[SpectrumSeries], sigma_b: float, *, tolerance: float, progress: Progress = silent
) -> np.ndarray:
    """Compute the table (n, n) float32 of the excess albedo E of the mean of some spectra under a kernel sigma_b.

    It is read by table/albedo_bound.py. n is the least of BOUND_TEXELS with which 99 % of directions have a relative
    error of the bound of at most `tolerance`, or the greatest. `progress` is called with the stage "albedo bound"."""
    begun = _DONE[0] if any(series.periodic for series in ensemble) else 1.0
    told = span_of(progress, 0, begun)
    # The continuum is so smooth that the finer tables are read from the coarsest one.
    tables = (
        _continuum_table(series, sigma_b, part_of(told, "albedo bound", done=k, total=len(ensemble)))
        for k, series in enumerate(ensemble)
    )
    continuum: np.ndarray = reduce(np.add, tables)
    probes = _probes()
    exact = _excess(ensemble, sigma_b, probes, continuum=_read_planes(continuum, probes), step=_STEP)
    exact = 1 + np.maximum(exact / probes[..., 2], 0)
    for count, begin, end in zip(BOUND_TEXELS, _DONE, _DONE[1:], strict=False):
        directions = texel_directions(count)
        told = span_of(progress, begin, end)
        read = _read_planes(continuum, directions)
        excess = _excess(ensemble, sigma_b, directions, continuum=read, step=_STEP, progress=told)
        if excess.max() < _ROUNDING:
            table = np.zeros_like(excess, np.float32)
            break
        table = bspline.interpolating(excess).astype(np.float32)
        if np.percentile(np.abs(albedo_bound(table, probes) / exact - 1), 99) <= tolerance:
            break
    progress("albedo bound", 1.0)
    return table


def excess_at(ensemble: Sequence[SpectrumSeries], sigma_b: float, directions: np.ndarray) -> np.ndarray:
    """The excess albedo E (rows, cols) for unit vectors (rows, cols, 3), without a table and at all wavelengths.

    It is faster if neighbours in the array are neighbours on the hemisphere."""
    lambdas = _wavelengths()[::_STRIDE]
    parts = (
        continuum_albedo(series, find_orders(series), sigma_b, directions=directions, lambdas=lambdas)
        for series in ensemble
    )
    continuum: np.ndarray = reduce(np.add, parts)
    return _excess(ensemble, sigma_b, directions, continuum=continuum, step=1)


def _wavelengths() -> np.ndarray:
    return np.geomspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, _WAVELENGTHS)


def _probes() -> np.ndarray:
    """Unit vectors (1, n, 3): half cosine weighted, half with uniformly distributed cosines."""
    rng = np.random.default_rng(0)
    share, azimuth = rng.random(_PROBES), rng.uniform(-np.pi, np.pi, _PROBES)
    cosine = np.where(np.arange(_PROBES) % 2, np.sqrt(share), share)
    sine = np.sqrt(1 - cosine**2)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=-1)[None]


def _continuum_table(series: SpectrumSeries, sigma_b: float, progress: Progress) -> np.ndarray:
    """The continuum's A (n, rows, cols) at every _STRIDE-th wavelength, at the texels of the coarsest table.

    One corner of the table is computed; quarter turns give the other corners."""
    count, lambdas = BOUND_TEXELS[0], _wavelengths()[::_STRIDE]
    corner = texel_directions(count)[count // 2 :, count // 2 :]
    orders = find_orders(series)
    found = continuum_albedo(series, orders, sigma_b, directions=corner, lambdas=lambdas, turns=4, progress=progress)
    # A quarter turn leads from +T to +B. Axis 0 follows B and axis 1 T.
    corners = [np.rot90(part, -turn) for turn, part in enumerate(np.split(found, 4, axis=1))]
    return np.moveaxis(np.block([[[corners[2]], [corners[3]]], [[corners[1]], [corners[0]]]]), -1, 0)


def _read_planes(planes: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Read planes (n, count, count) over the disc at unit vectors (rows, cols, 3); (rows, cols, n)."""
    y, x = place(directions, planes.shape[1])
    return np.stack([bspline.read_grid(bspline.interpolating(plane), y, x) for plane in planes], axis=-1)


def _excess(
    ensemble: Sequence[SpectrumSeries],
    sigma_b: float,
    directions: np.ndarray,
    *,
    continuum: np.ndarray,
    step: int,
    progress: Progress = silent,
) -> np.ndarray:
    """E (rows, cols) for light from directions (rows, cols, 3).

    continuum (rows, cols, n) is the sum of the spectra's continua at every _STRIDE-th wavelength. Orders are computed
    at every step-th wavelength, then at all wavelengths around the largest A."""
    cosine, lambdas = directions[..., 2], _wavelengths()
    smooth, sharp = continuum, []
    for series in ensemble:
        smooth = smooth + cosine[..., None] * zero_order_albedo(series, sigma_b, cosine, lambdas=lambdas[::_STRIDE])
        orders = Orders(series, sigma_b)
        # A single bin matters at the horizon only if it is an order: a continuum's bins cross it together with others.
        if series.periodic and len(orders):
            sharp.append(orders)
        else:
            smooth = smooth + orders_albedo(series, sigma_b, directions=directions, lambdas=lambdas[::_STRIDE])
    smooth, wi = smooth.reshape(cosine.size, -1), directions.reshape(-1, 3).astype(np.float32)
    largest = _largest_with(sharp, smooth, wi, step=step, progress=progress) if sharp else smooth.max(axis=-1)
    return largest.reshape(cosine.shape) / len(ensemble) - cosine


def _largest_with(
    sharp: list[Orders], smooth: np.ndarray, wi: np.ndarray, *, step: int, progress: Progress
) -> np.ndarray:
    """The largest A (n,) over all wavelengths: the sum of the smooth light (n, wavelengths) and of the orders."""
    lambdas = _wavelengths()

    def reflected(k: int, light: np.ndarray | slice) -> np.ndarray:
        before, share = divmod(k, _STRIDE)
        after = min(before + 1, smooth.shape[1] - 1)
        found = smooth[light, before] + (smooth[light, after] - smooth[light, before]) * (share / _STRIDE)
        return found + sum(orders.albedo(lambdas[k], wi[light]) for orders in sharp)

    largest, found_at = np.full(len(wi), -np.inf), np.zeros(len(wi), int)
    for k in range(0, len(lambdas), step):
        values = reflected(k, slice(None))
        found_at[values > largest] = k
        np.maximum(largest, values, out=largest)
        progress("albedo bound", (k + 1) / len(lambdas))
    for k in (k for k in range(len(lambdas)) if k % step):
        light = np.flatnonzero(abs(found_at - k) < step)
        largest[light] = np.maximum(largest[light], reflected(k, light))
    return largest
