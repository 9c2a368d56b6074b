# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes how much more light a relief sends out of its plate, because the plate traps light and gives it back.

The plate's front face returns the share r of the light from inside: by Fresnel's formula, and all of it beyond the
critical angle. The relief scatters it again, into the same directions: those that differ by sums of the relief's
frequencies. With S, the relief's efficiencies between directions inside, and T = 1 - r, the plate sends out

    T S (1 - r S)^-1 T

where powers add, because the plate is thicker than the light is coherent (docs/theory.md, "A plate"). k is the
tangential part of a direction of travel inside, c its cosine.

- The share of the light at k that leaves at all is V: V = S (T + r V), with S symmetric, on a grid in k.
- The mirror image is light that returns to its own k, which it does through the orders only. With N, the sum of all
  ways back to k without passing through k in between, it is T^2 N / (1 - r N). A single pass is T^2 Z, the zero order.
- The rest, T V minus the mirror image, is scattered. The material has S times a product g(wi) g(wr), so that the BRDF
  stays reciprocal, and each direction sends out the right luminance. There is one such g: the scaling of a symmetric
  matrix to given sums (Sinkhorn and Knopp 1967).

Close to grazing light r grows steeply, and with it the ways through k itself, so g = T h / (1 - r Z) with a smooth h.
S is the ratio form (optics/brdf.py) times the matter's reflectance and the relief's spectrum. Light from a direction
that S sends out more than once in sum is scaled down to once.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..colour.channels import channel_weights
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, seen_wavelengths
from ..maths import bspline, chebyshev
from ..optics.brdf import half_angle_cosine, scattering_factor
from ..optics.plate import face_reflectance
from ..reflectance.matter import Matter
from ..spectra.series import Resampler, SpectrumSeries
from ..table.plate_gains import GAIN_TEXELS, PlateGains, texel_directions

# The number of wavelengths from 380 to 780 nm.
_WAVELENGTHS = 17
# The number of steps of k from 0 to 1.
_STEPS = 20
# The kernel of light that is no order, in steps: sums over k are then flat to 2 exp(-2 pi^2 0.6^2) = 2e-3.
_KERNEL = 0.6
# An order of a surface that wraps is the strongest bin that is left, with more than this share of the light, and all
# such bins within _WIDTH in q. At most _ORDERS count; light of the others is blurred.
_SHARE, _WIDTH, _ORDERS = 3e-4, 0.03 / 550e-9, 24
_COSINE_MIN = 1e-3
# What the face loses beyond the critical angle: over a perfect flat mirror, light would else stay for ever.
_LOST = 1e-6
# Curves over a cosine have so many samples.
_SAMPLES = 257
# The steps of the scaling, and the largest h: where a single pass sends out next to nothing, no gain mends it.
_SCALINGS, _GAIN_MAX = 60, 8.0


def plate_gains(ensemble: Sequence[SpectrumSeries], sigma_b: float, *, matter: Matter, illuminant: str) -> PlateGains:
    """The gains of a relief under the plate of a matter. The spectra and sigma_b are those inside the plate."""
    ior = matter.plate_ior
    lambdas = seen_wavelengths(np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, _WAVELENGTHS), illuminant)
    weights = channel_weights(lambdas, illuminant)
    orders, grid = _Orders.of(ensemble), _Grid.under(ior, matter.ratio_ior)
    reliefs = [_Relief.of(orders, matter, float(lam)) for lam in lambdas]
    luminances = weights[:, 1] / weights[:, 1].sum()
    mean_zero = luminances @ [relief.zero_curve for relief in reliefs]

    def through(k: np.ndarray) -> np.ndarray:
        """T / (1 - r Z) (...,) by luminance."""
        face = _face(k, ior)
        return (1 - face) / (1 - face * _at(mean_zero, _cosine(k)))

    k_texels = texel_directions(GAIN_TEXELS)[..., :2] / ior
    face, cosine = _face(k_texels, ior), _cosine(k_texels)
    scattered, single = np.zeros(len(grid.k)), np.zeros((len(grid.k),) * 2)
    mirror = np.zeros((*face.shape, weights.shape[1]))
    for relief, y, weight in zip(reliefs, luminances, weights, strict=True):
        spread, (landing, power) = relief.spread(grid, sigma_b), relief.ordered(grid.k)
        zero = _at(relief.zero_curve, grid.cosine)
        ways = zero.copy()
        ways[grid.near] = relief.ways_back(grid.k[grid.near], ior)
        passed = 1 - grid.face
        leaving = _leaving(grid, ior, spread=spread, landing=landing, power=power, zero=zero)
        scattered += y * passed * (leaving - passed * ways / (1 - grid.face * ways))
        single += y * spread * through(grid.k)
        grid.add(single, landing, y * power * through(landing), reach=grid.rim)
        more, zero = grid.read(ways - zero, k_texels, grid.horizon), _at(relief.zero_curve, cosine)
        back = (zero + more) / (1 - face * (zero + more)) - zero
        mirror += ((1 - face) ** 2 * back)[..., None] * weight
    smooth = np.ones(len(grid.k))
    inner = grid.inner
    smooth[inner] = _scaling(single[np.ix_(inner, inner)], np.maximum(scattered, 0)[inner] / through(grid.k[inner]))
    gain = grid.read(smooth, k_texels, grid.rim) * through(k_texels)
    tables = [bspline.interpolating(each) for each in (gain, *np.moveaxis(mirror, -1, 0))]
    return PlateGains(tables[0].astype(np.float32), np.stack(tables[1:], axis=-1).astype(np.float32))


def _face(k: np.ndarray, ior: float) -> np.ndarray:
    """r (...,) at k (..., 2)."""
    return np.minimum(face_reflectance(k, ior), 1 - _LOST)


def _cosine(k: np.ndarray) -> np.ndarray:
    """The cosine (...,) of directions of travel with tangential parts k (..., 2)."""
    return np.sqrt(np.maximum(1 - np.sum(k**2, axis=-1), _COSINE_MIN**2))


def _at(curve: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    """A curve over cosines from 0 to 1, at a cosine (...,)."""
    return np.interp(cosine, np.linspace(0, 1, len(curve)), curve)


def _factor(k: np.ndarray, out: np.ndarray, ratio_ior: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For light that travels at k (..., 2) and leaves at `out` (..., 2): S without the reflectance and without the
    spectrum over w^2; then w, and the cosine of the half angle; each (...,)."""
    wi, wr = (np.concatenate([way, _cosine(way)[..., None]], axis=-1) for way in np.broadcast_arrays(-k, out))
    factor = scattering_factor(wi, wr, ratio_ior=ratio_ior) / wi[..., 2]
    return factor, wi[..., 2] + wr[..., 2], half_angle_cosine(wi, wr)


@dataclass(frozen=True)
class _Grid:
    """The directions of travel inside a plate, at equal steps of k.

    k, cosine, face  (n, 2), (n,), and the share r of the plate's face (n,)
    places           (a, a), the numbers of the directions; -1 beyond the horizon
    near, inner      the numbers of the directions that leave the plate or are beside such; and of those that leave it
    rim, horizon     within these |k| all four neighbours are in `inner`; are directions
    ratio_ior        the index of the matter's ratio form"""

    k: np.ndarray
    cosine: np.ndarray
    face: np.ndarray
    places: np.ndarray
    near: np.ndarray
    inner: np.ndarray
    rim: float
    horizon: float
    ratio_ior: float

    @cached_property
    def factor(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """_factor (n, n) float32 of each pair."""
        factor, w, half = _factor(self.k[:, None], self.k, self.ratio_ior)
        return factor.astype(np.float32), w.astype(np.float32), half.astype(np.float32)

    @cached_property
    def steps(self) -> np.ndarray:
        """The place (n, n) of the step from each direction to each other, in a flattened picture of k from -2 to 2."""
        place = np.rint(self.k * _STEPS).astype(int)
        x, y = np.moveaxis(place - place[:, None] + 2 * _STEPS, -1, 0)
        return y * (4 * _STEPS + 1) + x

    @classmethod
    def under(cls, ior: float, ratio_ior: float) -> "_Grid":
        """The grid under a plate."""
        axis = np.arange(-_STEPS, _STEPS + 1) / _STEPS
        x, y = np.meshgrid(axis, axis)
        real = x**2 + y**2 < 1 - 1e-9
        places = np.where(real, np.cumsum(real).reshape(real.shape) - 1, -1)
        k = np.stack([x[real], y[real]], axis=-1)
        radius, diagonal = np.hypot(*k.T), np.sqrt(2) / _STEPS
        near, inner = (np.flatnonzero(radius < 1 / ior + more) for more in (diagonal, 0))
        return cls(k, _cosine(k), _face(k, ior), places, near, inner, 1 / ior - diagonal, 1 - diagonal, ratio_ior)

    def _cells(self, k: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Numbers and shares (..., 4) of the directions around k (..., 2), which is moved inwards to |k| = reach."""
        radius = np.linalg.norm(k, axis=-1, keepdims=True)
        at = k * np.minimum(1, reach / np.maximum(radius, 1e-9)) * _STEPS + _STEPS
        first = np.floor(at).astype(int)
        x, y = np.moveaxis(at - first, -1, 0)
        col, row = np.moveaxis(first, -1, 0)
        numbers = [self.places[row + down, col + right] for down in (0, 1) for right in (0, 1)]
        return np.stack(numbers, axis=-1), np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], axis=-1)

    def read(self, values: np.ndarray, k: np.ndarray, reach: float) -> np.ndarray:
        """Values (n,) at k (..., 2), linear between the directions."""
        numbers, shares = self._cells(k, reach)
        return np.sum(values[numbers] * shares, axis=-1)

    def add(self, matrix: np.ndarray, k: np.ndarray, values: np.ndarray, *, reach: float) -> None:
        """Add values (n, m), of light from each direction to k (n, m, 2), to a matrix (n, n)."""
        numbers, shares = self._cells(k, reach)
        rows = np.broadcast_to(np.arange(len(matrix))[:, None, None], numbers.shape)
        np.add.at(matrix, (rows, numbers), values[..., None] * shares)


def _leaving(
    grid: _Grid, ior: float, *, spread: np.ndarray, landing: np.ndarray, power: np.ndarray, zero: np.ndarray
) -> np.ndarray:
    """V (n,) on a grid: see the file's docstring."""
    face = _face(landing, ior)
    back = spread * grid.face
    back[np.diag_indices_from(back)] += zero * grid.face
    grid.add(back, landing, power * face, reach=grid.horizon)
    passed = (spread + np.diag(zero)) @ (1 - grid.face) + np.sum(power * (1 - face), axis=-1)
    total = np.maximum(zero + spread.sum(axis=-1) + power.sum(axis=-1), 1)
    return np.linalg.solve(np.eye(len(back)) - back / total[:, None], passed / total)


def _scaling(matrix: np.ndarray, sums: np.ndarray) -> np.ndarray:
    """h (n,) with h_i sum_j matrix_ij h_j = sums_i, at most _GAIN_MAX; 1 where nothing is scattered."""
    found = np.ones(len(sums))
    for _ in range(_SCALINGS):
        single = matrix @ found
        wanted = np.where(single > 1e-6, sums / np.maximum(single, 1e-6), 1.0)
        found = np.minimum(np.sqrt(found * wanted), _GAIN_MAX)
    return found


@dataclass(frozen=True)
class _Orders:
    """The spectra of a relief as orders and a rest.

    ensemble  the spectra, of which the mean counts
    rest      each spectrum over s^2 (count, ny, nx), without the orders
    over_s2   the orders' power over s^2 (m, count)
    q         their frequencies (m, 2)
    between   (m + 1, m + 1): which order leads from one to another, counted from 1; 0 is the zero order, which leads
              from each to itself, and -1 none"""

    ensemble: Sequence[SpectrumSeries]
    rest: list[np.ndarray]
    over_s2: np.ndarray
    q: np.ndarray
    between: np.ndarray

    @classmethod
    def of(cls, ensemble: Sequence[SpectrumSeries]) -> "_Orders":
        """Find the orders. Only a single surface that wraps has any."""
        series, rest = ensemble[0], [each.scattered_over_s2.copy() for each in ensemble]
        powers: list[np.ndarray] = []
        places: list[list[float]] = []
        if len(ensemble) == 1 and series.periodic and not series.blur_q:
            squares = chebyshev.nodes(len(series.amplitude), 0, series.s_max)[:, None, None] ** 2
            share = np.max(rest[0] * squares, axis=0)
            while len(places) < _ORDERS and share.max() > _SHARE:
                row, col = np.unravel_index(share.argmax(), share.shape)
                away = np.hypot(series.grid.q_y[:, None] - series.grid.q_y[row], series.grid.q_x - series.grid.q_x[col])
                own = np.nonzero((away < _WIDTH) & (share > _SHARE))
                of_bins = share[own] / share[own].sum()
                places.append([of_bins @ series.grid.q_x[own[1]], of_bins @ series.grid.q_y[own[0]]])
                powers.append(rest[0][:, own[0], own[1]].sum(axis=-1))
                rest[0][:, own[0], own[1]] = share[own] = 0
        q = np.reshape(places, (-1, 2))
        lattice = np.concatenate([np.zeros((1, 2)), q])
        steps = lattice - lattice[:, None]
        away = np.linalg.norm(steps[:, :, None] - lattice, axis=-1)
        between = np.where(away.min(axis=-1) < _WIDTH, away.argmin(axis=-1), -1)
        return cls(ensemble, rest, np.reshape(powers, (len(q), len(series.amplitude))), q, between)


@dataclass(frozen=True)
class _Relief:
    """A relief at one wavelength in metres.

    reflectance  the matter's, (_SAMPLES,) over the cosine of the half angle
    zero_curve   Z (_SAMPLES,) over the cosine of a direction inside
    over_w2      the orders' efficiencies over w^2 (m, _SAMPLES), over w / 2
    ratio_ior    the index of the matter's ratio form"""

    orders: _Orders
    lam: float
    reflectance: np.ndarray
    zero_curve: np.ndarray
    over_w2: np.ndarray
    ratio_ior: float

    @classmethod
    def of(cls, orders: _Orders, matter: Matter, lam: float) -> "_Relief":
        """The relief of a matter."""
        cosine, ensemble = np.linspace(0, 1, _SAMPLES), orders.ensemble
        reflectance = matter.reflectance(np.array([lam]), cosine)[0]
        zero = sum(series.zero_order(2 * cosine / lam) for series in ensemble) / len(ensemble)
        over_w2 = orders.over_s2 @ ensemble[0].weights(2 * cosine / lam).T / lam**2
        return cls(orders, lam, reflectance, zero * reflectance, over_w2, matter.ratio_ior)

    def spread(self, grid: _Grid, sigma_b: float) -> np.ndarray:
        """S (n, n) of the light that is no order, times the area of a step of k."""
        axis, sigma = np.arange(-2 * _STEPS, 2 * _STEPS + 1) / _STEPS, max(sigma_b, _KERNEL / _STEPS)
        ensemble = self.orders.ensemble
        count = max(len(series.amplitude) for series in ensemble)
        w = chebyshev.nodes(count, 0, 2)
        pictures = np.zeros((count, len(axis), len(axis)))
        for series, rest in zip(ensemble, self.orders.rest, strict=True):
            resample = Resampler(series.grid, axis, axis, self.lam, series.kernel_left(sigma, self.lam))
            at_nodes = np.stack([resample(power[resample.kept]) for power in rest])
            pictures += np.tensordot(series.weights(w / self.lam) / self.lam**2 / len(ensemble), at_nodes, axes=1)
        terms = np.tensordot(chebyshev.coefficients_from_nodes(count), pictures, axes=1).astype(np.float32)
        factor, w, half = grid.factor
        found = np.zeros_like(w)
        for term, polynomial in zip(terms, chebyshev.recurrence(w - 1), strict=False):
            found += polynomial * term.take(grid.steps)
        return np.maximum(found * factor * _at(self.reflectance, half), 0) / _STEPS**2

    def ordered(self, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the orders of light at k (n, 2) leave, (n, m, 2), and their efficiencies (n, m)."""
        landing = k[:, None] + self.lam * self.orders.q
        return landing, self._efficiency(np.arange(1, 1 + len(self.orders.q)), k[:, None], landing)

    def ways_back(self, k: np.ndarray, ior: float) -> np.ndarray:
        """N (n,): the sum of all ways from k (n, 2) through orders back to k, without passing through k in between."""
        lattice = np.concatenate([np.zeros((1, 2)), self.orders.q])
        at = k[:, None] + self.lam * lattice
        out_of = self._efficiency(self.orders.between, at[:, :, None], at[:, None])
        out_of /= np.maximum(out_of.sum(axis=-1, keepdims=True), 1)
        face = _face(at, ior)
        face[:, 0] = 0
        # out_of leads from its first index to its second; the last step leads to k, lattice point 0.
        back = np.linalg.solve(np.eye(len(lattice)) - out_of * face[:, None], out_of[:, :, :1])
        return back[:, 0, 0]

    def _efficiency(self, order: np.ndarray, k: np.ndarray, out: np.ndarray) -> np.ndarray:
        """S (...,) from k (..., 2) to `out` (..., 2) by an order, as in _Orders.between."""
        factor, w, half = _factor(k, out, self.ratio_ior)
        curves = np.concatenate([np.zeros((2, _SAMPLES)), self.over_w2])
        at = np.minimum(w / 2 * (_SAMPLES - 1), _SAMPLES - 1 - 1e-9)
        below = at.astype(int)
        low, high = curves[order + 1, below], curves[order + 1, below + 1]
        found = factor * _at(self.reflectance, half) * (low + (high - low) * (at - below))
        found = np.where(order == 0, _at(self.zero_curve, w / 2), found)
        is_real = (np.sum(k**2, axis=-1) < 1) & (np.sum(out**2, axis=-1) < 1)
        return np.where(is_real, found, 0)
