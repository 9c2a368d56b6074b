# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the albedo bound from direct sums, for `check` only (docs/theory.md, "BRDF", "Albedo bound").

For light from wi, the albedo at R = 1 times cos(ti) is the integral of

    (1 + wi.wr)^2 / cos(tr) PSD(u, v, w) / w^2

over the (u, v) of all views, plus the zero order's share times cos(ti). The bound is the largest albedo over all
wavelengths, or 1.

The scattered spectrum is summed at some values of s (cells.py) and interpolated by a polynomial. At each
wavelength its cells are added up in blocks of (u, v). The strongest cells of a surface that wraps are its orders: they
keep their own places, and are summed at more wavelengths. Each block and each order is spread by the coherence kernel.
Near the horizon a part of the kernel is below it, and 1 / cos(tr) is infinite. There the integral runs over c =
cos(tr): with the view's radius r = sqrt(1 - c^2), dr / c = -dc / r.

The accuracy that the bound needs: a relative error e of all of a direction's light causes a dE00 of at most 22 e, at Y
= 1: dL* = 116 / 3 e, over 1.75, which is CIEDE2000's weight of lightness. So an error of 0.25 % causes a dE00 of 0.06.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from ..base.progress import Progress, silent
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M
from ..surface.relief import Relief
from .cells import scattered_cells
from .direct_sums import zero_order_efficiency

# Number of wavelengths of the blocks, equally spaced in their logarithm, and steps between two of them for the orders.
# At |(u, v)| = 1 an order moves by 0.0014 per step, a fifth of a default kernel's sigma_b.
_WAVELENGTHS, _STEPS = 17, 32
# The least width of a block, also in units of sigma_b. A block's even light adds width^2 / 12 to the kernel's variance.
_BLOCK, _BLOCK_TO_SIGMA = 0.0175, 0.6
# The greatest number of orders of a surface that wraps, and the least share of the light of each, at some s.
_ORDERS, _ORDER_SHARE = 256, 3e-4
# The kernel is cut at _REACH standard deviations. Within _NEAR of them from the horizon, it is integrated across the
# horizon over _PLACES places; farther away 1 / cos(tr) is taken at its centre.
_REACH, _NEAR, _PLACES = 4.5, 9.0, 12
# Places from -1 to 1, and their weights.
_GAUSS = np.polynomial.legendre.leggauss(_PLACES)


@dataclass(frozen=True)
class Spectrum:
    """The scattered spectrum of a relief, over s^2, at Chebyshev nodes of s (count,) from 0 to s_max.

    q_y, q_x  the cells' frequencies, cycles per metre
    over_s2   (count, ny, nx)"""

    relief: Relief
    q_y: np.ndarray
    q_x: np.ndarray
    over_s2: np.ndarray

    def terms(self, lam: float) -> np.ndarray:
        """The matrix (count, count) from over_s2 to Chebyshev coefficients in w - 1 of the power over w^2 at lam."""
        middles = _nodes(len(self.over_s2))
        at_nodes = np.linalg.inv(chebvander(middles, len(middles) - 1))
        # s = w / lam, where w = middles + 1; s runs from 0 to 2 / WAVELENGTH_MIN_M.
        in_s = (middles + 1) * WAVELENGTH_MIN_M / lam - 1
        return at_nodes @ chebvander(in_s, len(middles) - 1) @ at_nodes / lam**2


def _nodes(count: int) -> np.ndarray:
    return np.cos((np.arange(count) + 0.5) * np.pi / count)


def spectrum_of(relief: Relief, sigma_b: float, progress: Progress = silent) -> Spectrum:
    """Compute the spectrum of a relief, for kernels of at least sigma_b.

    The light of two heights d apart changes with s as exp(-i 2 pi s d). Over the range of s this takes about z terms, z
    = pi s_max d. Hardly any light has the largest d, so 0.6 z + 8 terms are used for it."""
    s_max = 2 / WAVELENGTH_MIN_M
    count = int(np.ceil(0.6 * np.pi * s_max * relief.height_range_m)) + 8
    reach = (2 + _REACH * sigma_b) / WAVELENGTH_MIN_M
    found = []
    for k, node in enumerate(_nodes(count)):
        s = s_max * (node + 1) / 2
        cells = scattered_cells(relief, s, (reach, reach), sigma_q=sigma_b / WAVELENGTH_MAX_M)
        found.append((cells.power / s**2).astype(np.float32))
        progress("albedo", (k + 1) / count)
    return Spectrum(relief, cells.q_y, cells.q_x, np.stack(found))


def albedo_bound(spectra: Sequence[Spectrum], directions: np.ndarray, *, sigma_b: float) -> np.ndarray:
    """max(1, albedo) (n,) at unit vectors (n, 3), of the mean of some spectra under a kernel of sigma_b."""
    lambdas = np.geomspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, _STEPS * (_WAVELENGTHS - 1) + 1)
    total = np.zeros(())
    for spectrum in spectra:
        orders = _orders(spectrum)
        cosine = directions[:, 2:]
        smooth = cosine * zero_order_efficiency(spectrum.relief, 2 * cosine[:, 0], lambdas[::_STEPS])
        smooth += _of_blocks(spectrum, orders, directions, lambdas[::_STEPS], sigma_b=sigma_b)
        total = total + _between(smooth)
        if len(orders):
            total = total + _of_orders(spectrum, orders, directions, lambdas, sigma_b)
    return np.maximum(np.max(total, axis=1) / len(spectra) / np.maximum(directions[:, 2], 1e-6), 1)


def _between(values: np.ndarray) -> np.ndarray:
    """Interpolate values (n, m) at every _STEPS-th wavelength linearly to all wavelengths."""
    count = (values.shape[1] - 1) * _STEPS + 1
    return np.stack([np.interp(np.arange(count), np.arange(0, count, _STEPS), row) for row in values])


def _orders(spectrum: Spectrum) -> np.ndarray:
    """Flat indices of the cells that count as orders."""
    if not spectrum.relief.periodic:
        return np.empty(0, int)
    s = (_nodes(len(spectrum.over_s2)) + 1) / WAVELENGTH_MIN_M
    share = np.max(spectrum.over_s2 * s[:, None, None] ** 2, axis=0).ravel()
    strongest = np.argsort(share)[-_ORDERS:]
    return strongest[share[strongest] > _ORDER_SHARE]


def _away(sigma: float) -> float:
    """The distance from the hemisphere's centre up to which a kernel is away from the horizon. It is at least the
    kernel's reach, within which a kernel cannot be integrated across the horizon alone."""
    return max(1 - _NEAR * sigma, _REACH * sigma)


def _above(radius: np.ndarray, sigma: float) -> tuple[np.ndarray, np.ndarray]:
    """Cosines of view (n, places), and weights (n, places) whose sum with g(cosine) is the mean of g / cosine over the
    part above the horizon of kernels at distances `radius` (n,) from the hemisphere's centre (Gauss-Legendre)."""
    place, weight = _GAUSS
    ends = np.clip(radius + _REACH * sigma, 0, 1), np.clip(radius - _REACH * sigma, 0, 1)
    low, high = (np.sqrt(1 - end**2)[:, None] for end in ends)
    cosine = low + (high - low) * (place + 1) / 2
    at = np.sqrt(1 - cosine**2)
    kernel = np.exp(-0.5 * ((at - radius[:, None]) / sigma) ** 2) / (np.sqrt(2 * np.pi) * sigma)
    return cosine, (high - low) / 2 * weight * kernel / np.maximum(at, 1e-9)


def _factors(wi: np.ndarray, u: np.ndarray, v: np.ndarray, sigma: float, count: int) -> np.ndarray:
    """Means (count, n) of (1 + wi.wr)^2 T_k(w - 1) / cos(tr) over kernels at u, v (n,), for light wi (n, 3)."""
    x, y = u - wi[:, 0], v - wi[:, 1]
    radius = np.hypot(x, y)
    found = np.zeros((count, len(u)))
    away = radius < _away(sigma)
    near = np.flatnonzero(~away & (radius < 1 + _REACH * sigma))
    cosine = np.sqrt(np.maximum(1 - radius[away] ** 2, 1e-6))
    wi_wr = x[away] * wi[away, 0] + y[away] * wi[away, 1] + cosine * wi[away, 2]
    basis = chebvander(cosine + wi[away, 2] - 1, count - 1)
    found[:, away] = ((1 + wi_wr) ** 2 / cosine)[None] * basis.T
    if len(near):
        light, far = wi[near], np.maximum(radius[near], 1e-9)
        cosine, weight = _above(radius[near], sigma)
        along = (x[near] * light[:, 0] + y[near] * light[:, 1]) / far
        wi_wr = along[:, None] * np.sqrt(1 - cosine**2) + cosine * light[:, 2:]
        basis = chebvander(cosine + light[:, 2:] - 1, count - 1)
        found[:, near] = np.einsum("np,npk->kn", weight * (1 + wi_wr) ** 2, basis)
    return found


def _of_orders(
    spectrum: Spectrum, orders: np.ndarray, directions: np.ndarray, lambdas: np.ndarray, sigma_b: float
) -> np.ndarray:
    """The orders' part (n, m) of the albedo times cos(ti)."""
    row, col = np.unravel_index(orders, spectrum.over_s2.shape[1:])
    held = spectrum.over_s2[:, row, col]
    found = np.zeros((len(directions), len(lambdas)))
    for k, lam in enumerate(lambdas):
        u, v = lam * spectrum.q_x[col], lam * spectrum.q_y[row]
        terms = spectrum.terms(lam) @ held
        near = np.hypot(u - directions[:, :1], v - directions[:, 1:2]) < 1 + _REACH * sigma_b
        light, order = np.nonzero(near)
        factors = _factors(directions[light], u[order], v[order], sigma_b, len(terms))
        found[:, k] = np.bincount(light, (factors * terms[:, order]).sum(axis=0), len(directions))
    return found


def _of_blocks(
    spectrum: Spectrum, orders: np.ndarray, directions: np.ndarray, lambdas: np.ndarray, *, sigma_b: float
) -> np.ndarray:
    """The part (n, m) of the albedo times cos(ti) of all cells except the orders."""
    width = max(_BLOCK, _BLOCK_TO_SIGMA * sigma_b)
    half = int(np.ceil((2 + _REACH * sigma_b) / width)) + 1
    middles = np.arange(-half, half + 1) * width
    over_s2 = spectrum.over_s2.copy()
    over_s2.reshape(len(over_s2), -1)[:, orders] = 0
    terms = np.zeros((len(over_s2), len(middles), len(middles), len(lambdas)), np.float32)
    for k, lam in enumerate(lambdas):
        counted = over_s2
        for axis, q in ((1, spectrum.q_y), (2, spectrum.q_x)):
            counted = _counted(counted, np.rint(lam * q / width).astype(int) + half, len(middles), axis)
        terms[..., k] = np.tensordot(spectrum.terms(lam).astype(np.float32), counted, axes=1)
    size = np.abs(terms).sum(axis=(1, 2, 3))
    terms = terms[: max(2, int(np.count_nonzero(np.cumsum(size[::-1])[::-1] > 1e-4 * size.sum())))]
    lit = np.abs(terms).max(axis=(0, 3))
    lit = lit > 1e-7 * lit.max(initial=0)
    sigma = np.sqrt(sigma_b**2 + width**2 / 12)
    found = np.empty((len(directions), len(lambdas)))
    for k, wi in enumerate(directions):
        near = np.hypot(middles - wi[0], middles[:, None] - wi[1]) < 1 + _REACH * sigma
        rows, columns = np.nonzero(near & lit)
        light = np.broadcast_to(wi, (len(rows), 3))
        factors = _factors(light, middles[columns], middles[rows], sigma, len(terms)).astype(np.float32)
        found[k] = np.einsum("kn,knm->m", factors, terms[:, rows, columns], optimize=True)
    return found


def _counted(values: np.ndarray, index: np.ndarray, count: int, axis: int) -> np.ndarray:
    """Sum values along an axis by their index (ascending) into `count` sums; other indices are ignored."""
    kept = np.flatnonzero((index >= 0) & (index < count))
    which, starts = np.unique(index[kept], return_index=True)
    shape = list(values.shape)
    shape[axis] = count
    found = np.zeros(shape, values.dtype)
    if len(kept):
        values = values[(slice(None),) * axis + (slice(kept[0], kept[-1] + 1),)]
        found[(slice(None),) * axis + (which,)] = np.add.reduceat(values, starts, axis=axis)
    return found
