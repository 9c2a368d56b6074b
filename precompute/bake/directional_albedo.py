# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the directional albedo of a spectrum by quadrature (docs/theory.md, section "BRDF", "Albedo bound").

Symbols: wi and wr are the unit vectors to the light and to the viewer, at the angles ti and tr from the normal; f is
the BRDF with Stam's obliquity and R = 1; PSD is the scattered power spectrum per (u, v); w = cos(ti) + cos(tr).

The albedo is a(wi) = integral of f cos(tr) dwr. At the horizon it diverges as 1 / cos(ti), but

    A = a cos(ti) = cos(ti) * zero order + integral of ((1 + wi.wr) / w)^2 * PSD / cos(tr) du dv

is finite: PSD vanishes as w^2, and 1 / cos(tr) is integrable.

The integral over PSD has two parts: the strongest bins (a grating's orders) one by one, each with its own kernel, and
all other light (the continuum) as a sum over the cells of a coarse picture in (u, v).
"""

import math

import numpy as np

from ..base.progress import Progress, silent
from ..maths import chebyshev
from ..spectra.resample import Resampler
from ..spectra.series import SpectrumSeries

# Orders are at most the _ORDERS strongest bins, if they hold more than _ORDER_SHARE of the light at some s. At the
# horizon an order's light has about ten times the weight.
_ORDERS, _ORDER_SHARE = 64, 3e-4
# Number of lights for which all orders are computed at once. Their numbers fit into a processor's cache.
_LIGHTS = 512
# Number of steps of w from 0 to 2 between which an order's efficiency is linear, to about 1e-4 of the largest.
_SAMPLES = 512
# Least square of a cosine away from the horizon.
_COSINE_MIN = np.float32(1e-6)
# The least step of the coarse picture in u and v, which is otherwise sigma_b.
_CELL_MIN = 1 / 32
# Cells per standard deviation of the coarse picture's kernel: sums over cells are flat to 2 exp(-2 pi^2 0.6^2) = 2e-3.
_CELLS_PER_SIGMA = 0.6
# A kernel is cut at this many standard deviations, where it has fallen to 4e-5 of its peak.
_KERNEL_REACH = 4.5
# Share of the light that the omitted Chebyshev terms may hold.
_TERMS_TOLERANCE = 1e-3
# Side of a block of directions that are computed at once. Neighbouring directions reach nearly the same cells.
_BLOCK = 8


def find_orders(series: SpectrumSeries) -> np.ndarray:
    """Flat indices (n,) of the bins that count as orders; empty if the bins have been blurred."""
    if series.blur_q:
        return np.empty(0, int)
    share = np.zeros(series.scattered_over_s2[0].size, np.float32)
    for power, s in zip(series.scattered_over_s2, chebyshev.nodes(len(series.amplitude), 0, series.s_max), strict=True):
        np.maximum(share, power.ravel() * np.float32(s**2), out=share)
    orders = np.argpartition(share, -min(_ORDERS, len(share)))[-_ORDERS:]
    return orders[share[orders] > _ORDER_SHARE]


def zero_order_albedo(series: SpectrumSeries, cosine: np.ndarray, *, lambdas: np.ndarray) -> np.ndarray:
    """Share (..., n) of the light that the zero order reflects, for light at cosine (...,)."""
    return np.stack([series.zero_order(2 * cosine / lam) for lam in lambdas], axis=-1)


def orders_albedo(series: SpectrumSeries, sigma_b: float, *, directions: np.ndarray, lambdas: np.ndarray) -> np.ndarray:
    """A (rows, cols, n) of the orders, for light from directions (rows, cols, 3) at n wavelengths."""
    wi, orders = directions.reshape(-1, 3).astype(np.float32), Orders(series, sigma_b)
    return np.stack([orders.albedo(lam, wi) for lam in lambdas], axis=-1).reshape(*directions.shape[:2], -1)


class Orders:
    """The bins of a series that count as orders. The light of each is a Gaussian of sigma_b about lambda * q."""

    def __init__(self, series: SpectrumSeries, sigma_b: float):
        row, col = np.unravel_index(find_orders(series), series.scattered_over_s2.shape[1:])
        self._series, self._q_x, self._q_y = series, series.grid.q_x[col], series.grid.q_y[row]
        self._over_s2 = series.scattered_over_s2[:, row, col]
        self._near = NearHorizon(sigma_b, -1)

    def __len__(self) -> int:
        return len(self._q_x)

    def albedo(self, lam: float, wi: np.ndarray) -> np.ndarray:
        """A (n,) for light from wi (n, 3) float32 at one wavelength."""
        near, found = self._near, np.zeros(len(wi))
        density = self._density(lam)
        u, v = ((lam * q).astype(np.float32) for q in (self._q_x, self._q_y))
        for block in (slice(start, start + _LIGHTS) for start in range(0, len(wi), _LIGHTS)):
            light = wi[block]
            x, y = u - light[:, :1], v - light[:, 1:2]
            radius2 = x * x + y * y
            away = radius2 < max(near.rim, 0) ** 2
            cosine = np.sqrt(np.maximum(1 - radius2, _COSINE_MIN))
            half2 = 1 + x * light[:, :1] + y * light[:, 1:2] + cosine * light[:, 2:]
            each = away * half2 * half2 / cosine * _read(density, np.arange(len(u)), cosine + light[:, 2:])
            found[block] = each.sum(axis=1)
            near_light, bin_ = np.nonzero(~away & (radius2 < near.reach**2))
            for weight, t in _views(light[near_light], u[bin_], v[bin_], near):
                each = weight * _read(density, bin_, t + 1)
                found[block] += np.bincount(near_light, each, len(light))
        return found

    def _density(self, lam: float) -> np.ndarray:
        """The orders' efficiency over w^2, (orders, _SAMPLES + 1) float32, at equal steps of w from 0 to 2."""
        w = np.linspace(0, 2, _SAMPLES + 1)
        return (self._over_s2.T @ self._series.weights(w / lam).T / lam**2).astype(np.float32)


def _read(samples: np.ndarray, row: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Interpolate samples (rows, _SAMPLES + 1) over w from 0 to 2 linearly, at rows and values of w that broadcast."""
    at = w * np.float32(_SAMPLES / 2)
    below = np.minimum(at.astype(np.int32), _SAMPLES - 1)
    place = below + (row * samples.shape[1]).astype(np.int32)
    low, high = samples.ravel().take(place), samples.ravel().take(place + 1)
    return low + (high - low) * (at - below)


def continuum_albedo(
    series: SpectrumSeries,
    orders: np.ndarray,
    sigma_b: float,
    *,
    directions: np.ndarray,
    lambdas: np.ndarray,
    turns: int = 1,
    progress: Progress = silent,
) -> np.ndarray:
    """A (rows, turns * cols, n) of a spectrum without its orders, at n wavelengths.

    The light comes from `directions` (rows, cols, 3). The result's next columns are for the same directions turned
    about the normal by one quarter turn, two quarter turns, and so on up to turns - 1.

    A is a sum over the cells of a coarse picture of the spectrum. A cell's light has a factor that depends on the
    light's direction and on the cell, but not on the wavelength, so one matrix product serves all wavelengths. The
    factors do not change if direction and picture are turned together, so for turned directions only the picture is
    turned, the other way."""
    cell = max(_CELL_MIN, sigma_b)
    sigma = max(sigma_b, _CELLS_PER_SIGMA * cell)
    half = math.ceil((2 + _KERNEL_REACH * sigma) / cell)
    axis = np.arange(-half, half + 1) * cell
    terms = coarse_terms(series, orders, axis, sigma=sigma, lambdas=lambdas)
    turned = [np.rot90(terms, turn, axes=(1, 2)) for turn in range(turns)]
    size = np.max([np.abs(each).max(axis=(0, 3)) for each in turned], axis=0)
    lit = size > 1e-7 * size.max()
    near = NearHorizon(sigma, -1)
    rows, cols = directions.shape[:2]
    out = np.zeros((rows, turns, cols, len(lambdas)))
    for y in range(0, rows, _BLOCK):
        for x in range(0, cols, _BLOCK):
            block = (slice(y, y + _BLOCK), slice(x, x + _BLOCK))
            wi = directions[block].reshape(-1, 3)
            near_v, near_u = (_reached(axis, wi[:, k], 1 + _KERNEL_REACH * sigma) for k in (1, 0))
            v, u = np.nonzero(lit[near_v, near_u])
            v, u = v + near_v.start, u + near_u.start
            factors = _factors(wi, axis[u], axis[v], near, len(terms)) * np.float32(cell**2)
            for turn, picture in enumerate(turned):
                albedo = factors.reshape(len(wi), -1) @ picture[:, v, u].reshape(-1, len(lambdas))
                part = out[block[0], turn, block[1]]
                part[...] = albedo.reshape(part.shape)
        progress("albedo bound", min(y + _BLOCK, rows) / rows)
    return out.reshape(rows, turns * cols, len(lambdas))


def coarse_terms(
    series: SpectrumSeries, orders: np.ndarray, axis: np.ndarray, *, sigma: float, lambdas: np.ndarray
) -> np.ndarray:
    """Chebyshev coefficients in w of PSD / lambda^2 / w^2 over axis x axis; (K, len(axis), len(axis), n) float32."""
    resamplers = [Resampler(series.grid, axis, axis, lam, series.kernel_left(sigma, lam)) for lam in lambdas]
    mixes = np.stack([_terms_in_w(series, lam) for lam in lambdas]).astype(np.float32)
    terms = np.zeros((len(series.amplitude), len(axis), len(axis), len(lambdas)), np.float32)
    # The picture is linear in the spectrum, so the spectra at the series' nodes are blurred instead of those at each w.
    for node, power in enumerate(series.scattered_over_s2):
        rest = power.copy()
        rest.ravel()[orders] = 0
        pictures = np.stack([resample(rest[resample.kept]) for resample in resamplers], axis=-1)
        for term, mix in zip(terms, mixes[:, :, node].T, strict=True):
            term += pictures * mix
    return _without_tail(terms)


def _without_tail(terms: np.ndarray) -> np.ndarray:
    """Drop the last terms of (K, ...) that together hold at most the share _TERMS_TOLERANCE; at least 2 remain."""
    size = np.abs(terms).reshape(len(terms), -1).sum(axis=1)
    needed = np.count_nonzero(np.cumsum(size[::-1])[::-1] > _TERMS_TOLERANCE * size.sum())
    return terms[: max(int(needed), 2)]


def _terms_in_w(series: SpectrumSeries, lam: float) -> np.ndarray:
    """The matrix (K, K) from values at the series' nodes in s to Chebyshev coefficients in w, divided by lambda^2."""
    count = len(series.amplitude)
    w = chebyshev.nodes(count, 0, 2)
    return chebyshev.coefficients_from_nodes(count) @ series.weights(w / lam) / lam**2


def _reached(axis: np.ndarray, centres: np.ndarray, reach: float) -> slice:
    """The slice of an axis that lies within `reach` of any of the centres."""
    return slice(*np.searchsorted(axis, [centres.min() - reach, centres.max() + reach]))


class NearHorizon:
    """The part of a kernel above the horizon, as two weighted cosines of the view.

    Take a kernel of standard deviation sigma about a place at distance rho from (0, 0), and any function g. The
    weighted sum of g at the two cosines is the mean of cos(tr)^power g(cos(tr)) over the kernel, for real directions
    only. It is exact for polynomials g of up to third degree (Gaussian quadrature). Away from the horizon both cosines
    are the place's own.

    Let c = cos(tr). For power = -1 the integrand 1 / c is integrable, but infinite at the horizon. With c as the
    variable, drho = -c / rho dc removes the pole: mean(g / c) = integral of N(sqrt(1 - c^2) - rho) g / sqrt(1 - c^2)
    dc, where N is the kernel across the horizon. The kernel's extent along the horizon is neglected: it only shifts rho
    by sigma^2 / 2."""

    def __init__(self, sigma: float, power: int):
        self.rim, self.reach = 1 - _KERNEL_REACH * sigma, 1 + _KERNEL_REACH * sigma
        rho = np.linspace(0, self.reach, 1 << 14)
        self._per_step = (len(rho) - 1) / rho[-1]
        cosine = np.sqrt(np.maximum(1 - rho**2, 1e-12))
        pairs = [(0.5 * cosine**power, cosine.copy()), (0.5 * cosine**power, cosine.copy())]
        rim = rho > self.rim
        c = (np.arange(512) + 0.5) / 512
        across = np.sqrt(1 - c**2)
        density = np.exp(-0.5 * ((across - rho[rim, None]) / sigma) ** 2) / (math.sqrt(2 * math.pi) * sigma)
        moments = (density / across / len(c)) @ c[:, None] ** (power + 1 + np.arange(4))
        for pair, values in zip(pairs, _gauss_of_two(moments), strict=True):
            for table, column in zip(pair, values, strict=True):
                table[rim] = column
        self._pairs = [(weight.astype(np.float32), cosine.astype(np.float32)) for weight, cosine in pairs]

    def __call__(self, rho: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Two pairs of weight and cosine, each (...,) float32, at distances rho (...,). The weight is 0 beyond the
        kernel's reach."""
        last = len(self._pairs[0][0]) - 1
        at = np.minimum((rho * self._per_step + 0.5).astype(np.int32), last)
        return [(weight[at] * (at < last), cosine[at]) for weight, cosine in self._pairs]


def _gauss_of_two(moments: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Two pairs of weight and node (n,) with the given moments (n, 4) of degree 0 to 3."""
    total = np.maximum(moments[:, 0], 1e-300)
    m1, m2, m3 = (moments[:, k] / total for k in (1, 2, 3))
    variance = np.maximum(m2 - m1**2, 1e-12)
    skew = (m3 - 3 * m1 * m2 + 2 * m1**3) / variance**1.5
    root = np.sqrt(1 + skew**2 / 4)
    deviation = np.sqrt(variance)
    return [
        (moments[:, 0] * 0.5 * (1 - sign * skew / 2 / root), np.clip(m1 + deviation * (skew / 2 + sign * root), 0, 1))
        for sign in (1, -1)
    ]


def _views(wi: np.ndarray, u: np.ndarray, v: np.ndarray, near: NearHorizon) -> list[tuple[np.ndarray, np.ndarray]]:
    """Two pairs of (1 + wi.wr)^2 / cos(tr) and w - 1, float32, for light wi (..., 3) and cells at u, v (...,)."""
    x, y = (u - wi[..., 0]).astype(np.float32), (v - wi[..., 1]).astype(np.float32)
    rho = np.hypot(x, y)
    wi = wi.astype(np.float32)
    along = (x * wi[..., 0] + y * wi[..., 1]) / np.maximum(rho, np.float32(1e-6))
    views = []
    for weight, cosine in near(rho):
        # Only a cell's part above the horizon counts: wr is the unit vector whose cosine NearHorizon gives.
        wi_wr = along * np.sqrt(1 - cosine**2) + cosine * wi[..., 2]
        views.append((weight * (1 + wi_wr) ** 2, cosine + wi[..., 2] - 1))
    return views


def _factors(wi: np.ndarray, u: np.ndarray, v: np.ndarray, near: NearHorizon, count: int) -> np.ndarray:
    """(1 + wi.wr)^2 T_k(w - 1) / cos(tr), (m, count, n) float32, for light wi (m, 3) and cells at u, v (n,)."""
    factors = np.zeros((len(wi), count, len(u)), np.float32)
    for weight, t in _views(wi[:, None], u, v, near):
        before, now = weight, t * weight
        for k in range(count):
            factors[:, k] += before
            before, now = now, 2 * t * now - before
    return factors
