# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the resolution that a surface's bake needs for a colour error dE00: terms in w, and texels per kernel width.

Bounds would cover the worst case: ideal line gratings, whose orders are as sharp as the kernel, and reliefs with as
much light at full depth as elsewhere. Therefore terms and texels are measured, on about twenty small patches of (u, v).
Some patches are where the light is. The others are near the zero order, where a deep relief's light changes fastest
with w. The light of a patch is computed at random places in two ways and compared: as the exact sum over the bins, and
as a reading, by cubic B-splines, of a small lattice of texels.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..colour.illuminants import line_of
from ..colour.observer import spectral_weights, white_xyz
from ..maths import bspline, chebyshev
from ..measure.errors import worst_exposure
from ..reflectance.curves import reflectance_at
from ..spectra.resample import KERNEL_REACH
from ..spectra.series import SpectrumSeries
from ..table.atlas import LARGEST_STORED
from .needs import Needs
from .request import BakeRequest

# The error of a cubic reading falls as the fourth power of the texels per standard deviation of the kernel. It is
# measured at _TEXELS_MEASURED. The lattice of a patch has _LATTICE texels along each side. It is read at _PLACES places
# along each axis, within its three middle cells.
_TEXELS_MEASURED, _LATTICE, _PLACES = 1.0, 6, 5
# The range of texels per standard deviation in which the fourth power holds. A reading of a Gaussian is off by 1.8 % of
# the peak at 1 texel, by 3.4 % at 0.9 texels and by 7.7 % at 0.8 texels, where the fourth power predicts only 2.7 % and
# 4.4 %: there the kernel that is sampled, sqrt(sigma^2 - texel^2 / 3), is so narrow that it falls between the texels.
# Above 1 texel the error falls slightly faster. The rounding of half floats shows before 4 texels.
TEXELS_MIN, TEXELS_MAX = 0.9, 4.0
# Shares of the requested dE00 for reading, truncated terms and half floats. The share of reading also keeps the error
# of luminance below the 1 % that belongs to a dE00 of 1. With a share of 0.75 it was too large for some surfaces, such
# as sample:elaphe, which had to be baked twice.
_READING_SHARE, _TERMS_SHARE, _HALVES_SHARE = 0.55, 0.25, 0.1
# Number of patches where the light is, and near the zero order.
_PATCHES_LIT, _PATCHES_INNER = 16, 5
# The least number of nodes of w, if the table holds a reflectance: it may change faster with w than the relief's light.
_NODES_OF_REFLECTANCE = 24
# A patch where the light is has its centre at a bin drawn in proportion to its power, moved along each axis by a random
# shift of this many standard deviations of the kernel. A reading errs most on an order and on its flanks.
_FLANK = 0.5


@dataclass(frozen=True)
class Probe:
    """The exact light on the patches, and a cubic reading of it.

    truth    (count, places, 3), exact scattered XYZ over w^2 at `count` Chebyshev nodes of w
    reading  (count, places, 3), scattered XYZ over w^2 at the same nodes and places, read from lattices of texels
    real     (count, places), whether some pair of directions reaches the place at the node's w
    white    (3,), XYZ of the illuminant"""

    truth: np.ndarray
    reading: np.ndarray
    real: np.ndarray
    white: np.ndarray

    def texels_per_sigma(self, delta_e: float) -> float:
        """The texels per standard deviation of the kernel that a dE00 of delta_e (99th percentile) needs."""
        excess = self._p99(self.reading) / (_READING_SHARE * delta_e)
        return float(np.clip(_TEXELS_MEASURED * excess**0.25, TEXELS_MIN, TEXELS_MAX))

    def terms(self, delta_e: float) -> int:
        """The least number of Chebyshev terms in w whose truncation takes at most its share of a dE00 of delta_e."""
        count = len(self.truth)
        coefficients = self._coefficients()
        for terms in range(2, count):
            if self._p99(self._sum(coefficients[:terms])) <= _TERMS_SHARE * delta_e:
                return terms
        return count

    def halves_do(self, terms: int, delta_e: float) -> bool:
        """Whether the rounding of `terms` terms to half floats takes at most its share of a dE00 of delta_e.

        The terms of a deep relief are large because the relief scatters most at w = 0. At large w the terms nearly
        cancel, and the rounding of half floats remains."""
        coefficients = self._coefficients()[:terms]
        scale = max(np.abs(coefficients).max(), 1e-30) / LARGEST_STORED
        stored = (coefficients / scale).astype(np.float16).astype(float) * scale
        return self._p99(self._sum(stored)) <= (_TERMS_SHARE + _HALVES_SHARE) * delta_e

    def _coefficients(self) -> np.ndarray:
        """Chebyshev coefficients (count, places, 3) of the truth in w."""
        return np.tensordot(chebyshev.coefficients_from_nodes(len(self.truth)), self.truth, axes=1)

    def _sum(self, coefficients: np.ndarray) -> np.ndarray:
        """Sum the first terms at the nodes of w."""
        basis = chebyshev.polynomials(chebyshev.nodes(len(self.truth), -1, 1), len(coefficients))
        return np.tensordot(basis, coefficients, axes=1)

    def _p99(self, answer: np.ndarray) -> float:
        """The 99th percentile of dE00 at real places, at the worst exposure."""
        truth = self.truth[self.real]
        return worst_exposure(truth, answer[self.real], np.ones(len(truth), bool), white=self.white)["p99"]


def probe(ensemble: Sequence[SpectrumSeries], sigma_b: float, lambdas: np.ndarray, *, request: BakeRequest) -> Probe:
    """Measure the mean of the ensemble's spectra under a kernel sigma_b, in the region of (u, v, w) and in the matter
    of a request."""
    rng = np.random.default_rng(0)
    needs, illuminant = request.needs, request.illuminant
    centres = _patch_centres(ensemble[0], sigma_b, needs, rng=rng, line_m=line_of(illuminant))
    texel = sigma_b / _TEXELS_MEASURED
    lattice = (np.arange(_LATTICE) - (_LATTICE - 1) / 2) * texel
    places = np.sort(rng.uniform(lattice[1], lattice[-2], (2, len(centres), _PLACES)), axis=-1)
    at = [np.concatenate([np.broadcast_to(lattice, (len(centres), _LATTICE)), places[k]], axis=1) for k in (0, 1)]
    v, u = (centres[:, k, None] + at[k] for k in (0, 1))
    # The texels' kernel is narrower, as in the bake: reading the texels widens it to sigma_b.
    sigma = np.repeat([math.sqrt(sigma_b**2 - bspline.VARIANCE * texel**2), sigma_b], [_LATTICE, _PLACES])
    count = max(len(series.amplitude) for series in ensemble)
    if request.matter.baked:
        count = max(count, _NODES_OF_REFLECTANCE)
    w = chebyshev.nodes(count, *needs.w)
    reflectance = reflectance_at(request.matter, lambdas, (u[:, None], v[:, :, None], w[:, None, None, None]))
    xyz = np.zeros((count, *v.shape, u.shape[1], 3))
    for k, (lam, weight) in enumerate(zip(lambdas, spectral_weights(lambdas, illuminant), strict=True)):
        density = np.mean([_density(series, v, u, w, lam, sigma) for series in ensemble], axis=0)
        xyz += (density * reflectance(k))[..., None] * weight
    truth = xyz[:, :, _LATTICE:, _LATTICE:]
    reading = _read(xyz[:, :, :_LATTICE, :_LATTICE], places[0] / texel, places[1] / texel)
    v, u = v[:, _LATTICE:, None], u[:, None, _LATTICE:]
    real = w[:, None, None, None] ** 2 + (v**2 + u**2) <= 4
    return Probe(
        truth.reshape(count, -1, 3), reading.reshape(count, -1, 3), real.reshape(count, -1), white_xyz(illuminant)
    )


def _patch_centres(
    series: SpectrumSeries, sigma_b: float, needs: Needs, *, rng: np.random.Generator, line_m: float | None
) -> np.ndarray:
    """Centres (n, 2) of the patches, as (v, u). `line_m` is the wavelength of a laser's line."""
    radius = np.exp(rng.uniform(math.log(2 * sigma_b), math.log(max(0.4, 3 * sigma_b)), _PATCHES_INNER))
    turn = rng.uniform(0, 2 * np.pi, _PATCHES_INNER)
    found = [radius[:, None] * np.column_stack([np.sin(turn), np.cos(turn)])]
    whole = (slice(None), slice(None))
    each = 4
    for _ in range(_PATCHES_LIT // each):
        lam, w = rng.uniform(450e-9, 650e-9), rng.uniform(*needs.w)
        lam = line_m or lam
        power = np.maximum(series.mixed(series.weights(np.array([w / lam])), whole)[:, 0], 0)
        cumulative = np.cumsum(power, dtype=float)
        if cumulative[-1] > 0:
            bins = np.searchsorted(cumulative, rng.random(each) * cumulative[-1])
            row, col = np.unravel_index(np.minimum(bins, power.size - 1), power.shape)
            middle = lam * np.column_stack([series.grid.q_y[row], series.grid.q_x[col]])
            found.append(middle + _FLANK * sigma_b * rng.standard_normal(middle.shape))
    centres = np.concatenate(found)
    low, high = zip(needs.region.v, needs.region.u, strict=True)
    return np.clip(centres, low, high)


def _density(
    series: SpectrumSeries, v: np.ndarray, u: np.ndarray, w: np.ndarray, lam: float, sigma: np.ndarray
) -> np.ndarray:
    """Scattered light over w^2 (len(w), patches, n, n) of one wavelength at each pair of a v and a u of a patch; both
    (patches, n).

    `sigma` (n,) is the standard deviation of the kernel at each v and each u."""
    left = np.array([series.kernel_left(each, lam) for each in sigma])
    rows, row_kernel = _kernels(series.grid.q_y, v, lam, left[:, 0])
    cols, col_kernel = _kernels(series.grid.q_x, u, lam, left[:, 1])
    bins = series.scattered_over_s2[:, rows[:, :, None], cols[:, None, :]]
    blurred = row_kernel @ bins @ col_kernel.transpose(0, 2, 1)
    return np.tensordot(series.weights(w / lam) / lam**2, blurred, axes=1)


def _kernels(q: np.ndarray, at: np.ndarray, lam: float, sigma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices (patches, m) of the bins around each patch, and their kernel weights (patches, n, m) at `at`."""
    if len(q) == 1:
        index = np.zeros((len(at), 1), int)
    else:
        middle = (at.min(axis=1) + at.max(axis=1)) / 2
        reach = (np.ptp(at, axis=1).max() / 2 + KERNEL_REACH * sigma.max()) / lam
        half = math.ceil(reach / (q[1] - q[0]))
        index = np.searchsorted(q, middle / lam)[:, None] + np.arange(-half, half + 1)
    inside = (index >= 0) & (index < len(q))
    index = np.clip(index, 0, len(q) - 1)
    distance = (at[:, :, None] - lam * q[index][:, None, :]) / sigma[:, None]
    near = inside[:, None, :] & (np.abs(distance) <= KERNEL_REACH)
    kernel = near * np.exp(-0.5 * distance**2) / (math.sqrt(2 * math.pi) * sigma[:, None])
    return index, kernel.astype(np.float32)


def _read(texels: np.ndarray, y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Read lattices (k, patches, rows, columns, 3) of texels at each pair of a y and an x of a patch.

    y and x (patches, n) count in texels from the centre of the lattice. Returns (k, patches, n, n, 3)."""
    shares = [_shares(each + (_LATTICE - 1) / 2) for each in (y, x)]
    return np.einsum("pij,kpjlc,pml->kpimc", shares[0], texels, shares[1], optimize=True)


def _shares(x: np.ndarray) -> np.ndarray:
    """Weights (patches, n, _LATTICE) of a lattice's texels in readings at x (patches, n), in texels from the first."""
    first, weights = bspline.taps(x, _LATTICE)
    out = np.zeros((*x.shape, _LATTICE))
    for k, weight in enumerate(weights):
        np.put_along_axis(out, (first + k)[..., None], weight[..., None], axis=-1)
    return out
