# SPDX-License-Identifier: GPL-3.0-or-later
"""What a dE00 takes on this very surface: how many terms in w, how many texels to a kernel.

Bounds alone ask for the worst: ideal line gratings, whose orders are as sharp as the kernel, and reliefs that have as
much light at their full depth as anywhere. So both are measured, on a dozen patches of (u, v): some where the light
is, some near the zero order, where a deep relief changes fastest with w. In each patch the exact sum over the bins
stands at random places, and a small lattice of texels, read by cubic B-splines, beside it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..colour.observer import spectral_weights, white_xyz
from ..maths import bspline, chebyshev
from ..measure.errors import worst_exposure
from ..spectra.resample import KERNEL_REACH
from ..spectra.series import SpectrumSeries
from ..table.atlas import LARGEST_STORED
from .needs import Needs

# The error of a cubic table falls as the fourth power of the texels to a standard deviation of the kernel: it is
# measured at so many, on a lattice of so many texels a side, at so many places a side in its three middle cells.
_TEXELS_MEASURED, _LATTICE, _PLACES = 1.0, 6, 5


# Of a Gaussian's peak a reading is off by 1.8 % at one texel, 3.4 % at 0.9 and 7.7 % at 0.8, where the kernel to
# sample, sqrt(sigma^2 - texel^2 / 3), falls between the texels: the fourth power of 0.9 is a quarter short of that, of
# 0.8 a half. Above, it falls a little faster; half floats show before four.
TEXELS_MIN, TEXELS_MAX = 0.9, 4.0


# Shares of the budget. The reading's, a dE00, also keeps |dY| under the percent that goes with a dE00 of 1: at 0.75
# some surfaces, sample:elaphe one of them, had to be baked twice for it.
_READING_SHARE, _TERMS_SHARE, _HALVES_SHARE = 0.55, 0.25, 0.1


_PATCHES_LIT, _PATCHES_INNER = 16, 5


# Where light is drawn from a bin, a patch lies about it by so many sigma: a reading errs most on an order and its
# flanks.
_FLANK = 0.5


@dataclass(frozen=True)
class Probe:
    """Truth and a cubic reading of it, scattered XYZ over w^2 (count, places, 3), at `count` Chebyshev nodes of w;
    `real` (count, places) marks the places that directions reach at that w."""

    truth: np.ndarray
    reading: np.ndarray
    real: np.ndarray
    white: np.ndarray

    def texels_per_sigma(self, delta_e: float) -> float:
        """Texels that one standard deviation of the kernel must span for a dE00 of delta_e (99th percentile)."""
        excess = self._p99(self.reading) / (_READING_SHARE * delta_e)
        return float(np.clip(_TEXELS_MEASURED * excess**0.25, TEXELS_MIN, TEXELS_MAX))

    def terms(self, delta_e: float) -> int:
        """The fewest Chebyshev terms in w whose truncation keeps to its share of a dE00 of delta_e."""
        count = len(self.truth)
        coefficients = self._coefficients()
        for terms in range(2, count):
            if self._p99(self._sum(coefficients[:terms])) <= _TERMS_SHARE * delta_e:
                return terms
        return count

    def halves_do(self, terms: int, delta_e: float) -> bool:
        """Whether half floats hold so many terms within their share of delta_e: a deep relief's are large for the
        sake of w = 0, where it scatters most, and all but cancel where w is large."""
        coefficients = self._coefficients()[:terms]
        scale = max(np.abs(coefficients).max(), 1e-30) / LARGEST_STORED
        stored = (coefficients / scale).astype(np.float16).astype(float) * scale
        return self._p99(self._sum(stored)) <= (_TERMS_SHARE + _HALVES_SHARE) * delta_e

    def _coefficients(self) -> np.ndarray:
        return np.tensordot(chebyshev.coefficients_from_nodes(len(self.truth)), self.truth, axes=1)

    def _sum(self, coefficients: np.ndarray) -> np.ndarray:
        basis = chebyshev.polynomials(chebyshev.nodes(len(self.truth), -1, 1), len(coefficients))
        return np.tensordot(basis, coefficients, axes=1)

    def _p99(self, answer: np.ndarray) -> float:
        truth = self.truth[self.real]
        return worst_exposure(truth, answer[self.real], np.ones(len(truth), bool), self.white)["p99"]


def probe(
    ensemble: Sequence[SpectrumSeries], sigma_b: float, lambdas: np.ndarray, illuminant: str, needs: Needs
) -> Probe:
    """Measure the mean of the ensemble's spectra under a kernel sigma_b, within the region of (u, v, w) asked for."""
    rng = np.random.default_rng(0)
    centres = _patch_centres(ensemble[0], sigma_b, needs, rng)
    texel = sigma_b / _TEXELS_MEASURED
    lattice = (np.arange(_LATTICE) - (_LATTICE - 1) / 2) * texel
    places = np.sort(rng.uniform(lattice[1], lattice[-2], (2, len(centres), _PLACES)), axis=-1)
    at = [np.concatenate([np.broadcast_to(lattice, (len(centres), _LATTICE)), places[k]], axis=1) for k in (0, 1)]
    v, u = (centres[:, k, None] + at[k] for k in (0, 1))
    # The texels' kernel is narrower by what reading them adds, as in the bake.
    sigma = np.repeat([math.sqrt(sigma_b**2 - bspline.VARIANCE * texel**2), sigma_b], [_LATTICE, _PLACES])
    count = max(len(series.amplitude) for series in ensemble)
    w = chebyshev.nodes(count, *needs.w)
    xyz = sum(_patches(series, v, u, w, lambdas, sigma, illuminant) for series in ensemble) / len(ensemble)
    truth = xyz[:, :, _LATTICE:, _LATTICE:]
    reading = _read(xyz[:, :, :_LATTICE, :_LATTICE], places[0] / texel, places[1] / texel)
    v, u = v[:, _LATTICE:, None], u[:, None, _LATTICE:]
    real = w[:, None, None, None] ** 2 + (v**2 + u**2) <= 4
    return Probe(
        truth.reshape(count, -1, 3), reading.reshape(count, -1, 3), real.reshape(count, -1), white_xyz(illuminant)
    )


def _patch_centres(series: SpectrumSeries, sigma_b: float, needs: Needs, rng: np.random.Generator) -> np.ndarray:
    """Centres (n, 2) of patches as (v, u)."""
    radius = np.exp(rng.uniform(math.log(2 * sigma_b), math.log(max(0.4, 3 * sigma_b)), _PATCHES_INNER))
    turn = rng.uniform(0, 2 * np.pi, _PATCHES_INNER)
    found = [radius[:, None] * np.column_stack([np.sin(turn), np.cos(turn)])]
    whole = (slice(None), slice(None))
    each = 4
    for _ in range(_PATCHES_LIT // each):
        lam, w = rng.uniform(450e-9, 650e-9), rng.uniform(*needs.w)
        power = np.maximum(series.mixed(series.weights(np.array([w / lam])), whole)[:, 0], 0)
        cumulative = np.cumsum(power, dtype=float)
        if cumulative[-1] > 0:
            bins = np.searchsorted(cumulative, rng.random(each) * cumulative[-1])
            row, col = np.unravel_index(np.minimum(bins, power.size - 1), power.shape)
            middle = lam * np.column_stack([series.grid.q_y[row], series.grid.q_x[col]])
            found.append(middle + _FLANK * sigma_b * rng.standard_normal(middle.shape))
    centres = np.concatenate(found)
    return np.clip(centres, *zip(needs.region.v, needs.region.u, strict=True))


def _patches(series: SpectrumSeries, v, u, w, lambdas, sigma, illuminant) -> np.ndarray:
    """Scattered XYZ over w^2 (len(w), patches, n, n, 3) at v x u (patches, n), the kernel sigma (n,) of each place."""
    out = np.zeros((len(w), *v.shape, v.shape[1], 3))
    for lam, weight in zip(lambdas, spectral_weights(lambdas, illuminant), strict=True):
        left = np.array([series.kernel_left(each, lam) for each in sigma])
        rows, row_kernel = _kernels(series.grid.q_y, v, lam, left)
        cols, col_kernel = _kernels(series.grid.q_x, u, lam, left)
        bins = series.scattered_over_s2[:, rows[:, :, None], cols[:, None, :]]
        blurred = row_kernel @ bins @ col_kernel.transpose(0, 2, 1)
        mix = series.weights(w / lam) / lam**2
        out += np.tensordot(mix, blurred, axes=1)[..., None] * weight
    return out


def _kernels(q: np.ndarray, at: np.ndarray, lam: float, sigma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices (patches, m) of the bins around each patch, and their weights (patches, n, m) at places (patches, n)."""
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
    """Lattices (k, patches, rows, columns, 3) read at y x x (patches, n), in texels from their middles."""
    shares = [_shares(each + (_LATTICE - 1) / 2) for each in (y, x)]
    return np.einsum("pij,kpjlc,pml->kpimc", shares[0], texels, shares[1], optimize=True)


def _shares(x: np.ndarray) -> np.ndarray:
    """Weights (patches, n, _LATTICE) of a lattice's texels for places x (patches, n) in texels from the first."""
    first, weights = bspline.taps(x, _LATTICE)
    out = np.zeros((*x.shape, _LATTICE))
    for k, weight in enumerate(weights):
        np.put_along_axis(out, (first + k)[..., None], weight[..., None], axis=-1)
    return out
