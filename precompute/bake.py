# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake: everything a material needs of a relief, in one table over (u, v) and a few terms in w.

    XYZ(u, v, w) = Z(w) * kernel(u, v) + w^2 * sum_k T_k(w - 1) B_k(u, v)          (DESIGN 2)

Per wavelength the spectrum at each w node is blurred and resampled onto (u, v) by two banded matrix products (the
kernel is separable and fixed in (u, v), so a wavelength only stretches the bins it acts on), weighted by the observer
and added up; a cosine transform over the nodes gives the B_k.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from . import albedo, chebyshev, coherence
from .colour import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, spectral_weights
from .failure import GratingError
from .relief import Relief
from .resample import KERNEL_REACH, Resampler
from .spectrum import SpectrumSeries, frequency_grid, spectrum_series

RESOLUTION_MIN, RESOLUTION_MAX = 256, 2048
TILE_PADDING = 2
# The curve of the zero order lies in one row of the atlas, which is at least two of the smallest tiles wide.
ZERO_ORDER_SAMPLES = 2 * RESOLUTION_MIN
# What a bake may take in Blender unless a coherence length is asked for; a packed picture is held as RGBA of 32 bits.
DEFAULT_BYTES = 128 << 20
BYTES_PER_TEXEL = 16
# Bins this far past |u| = 2 are kept, so that the kernel may still be widened.
_REACH_MIN = 0.15
_SERIES_TOLERANCE = 1e-4

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Bake:
    """A relief's table: `terms` (K, R, R, 3) float32 holds B_k in XYZ, row along +v, column along +u; texel i of an
    axis is at (i + 1/2 - R/2) * texel. `zero_order` (n, 3) is Z at n equal steps of w from 0 to 2, ends included.
    `limit` (rows, columns) float32 is the excess albedo that albedo.py tells of; without one, Stam's form is kept."""

    terms: np.ndarray
    zero_order: np.ndarray
    sigma_b: float
    texel: float
    illuminant: str
    limit: np.ndarray = field(default_factory=albedo.NO_LIMIT.copy)

    @property
    def resolution(self) -> int:
        return self.terms.shape[1]

    def scattered_over_w2(self, u: np.ndarray, v: np.ndarray, w) -> np.ndarray:
        """Scattered XYZ over w^2 (n, 3) at u, v (n,), read as a renderer reads it: bilinear, half floats as stored."""
        x = u / self.texel + self.resolution / 2 - 0.5
        y = v / self.texel + self.resolution / 2 - 0.5
        x0, y0 = (np.clip(np.floor(c).astype(int), 0, self.resolution - 2) for c in (x, y))
        fx, fy = (x - x0)[:, None, None], (y - y0)[:, None, None]
        texels = [[self.terms[:, y0 + j, x0 + i].transpose(1, 0, 2) for i in (0, 1)] for j in (0, 1)]
        lower = texels[0][0] * (1 - fx) + texels[0][1] * fx
        upper = texels[1][0] * (1 - fx) + texels[1][1] * fx
        basis = chebyshev.polynomials(np.broadcast_to(np.asarray(w, float) - 1, np.shape(u)), len(self.terms))
        return np.einsum("nkc,nk->nc", lower * (1 - fy) + upper * fy, basis)

    def zero_order_xyz(self, w) -> np.ndarray:
        """Z (..., 3) at w (...,), linear between samples."""
        at = np.linspace(0, 2, len(self.zero_order))
        return np.stack([np.interp(w, at, z) for z in self.zero_order.T], axis=-1)

    def kernel(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """The coherence kernel (n,) that carries the zero order."""
        return np.exp(-(u**2 + v**2) / (2 * self.sigma_b**2)) / (2 * np.pi * self.sigma_b**2)

    def limit_at(self, directions: np.ndarray) -> np.ndarray:
        """max(1, albedo) (...,) for directions (..., 3): the energy-conserving form divides f by the greater of the
        light's and the view's."""
        return albedo.limit(self.limit, directions)

    def candidate(self, u, v, w) -> tuple[np.ndarray, np.ndarray]:
        """The bake as metric.measure wants it."""
        return self.scattered_over_w2(u, v, w), self.zero_order_xyz(w)


def texel_size(resolution: int) -> float:
    """Step in u of a tile whose inner texels cover [-2, 2]."""
    return 4 / (resolution - 2 * TILE_PADDING)


def texels_per_sigma(delta_e: float) -> float:
    """Texels that one standard deviation of the kernel must span for a dE00 of delta_e (99th percentile).

    The error of a bilinear table falls as the square of that number. On the sharpest surfaces, ideal line gratings,
    it is 1.25 at 2 texels (sample:sinusoidal, sample:blazed); a fifth of the budget is left to the other errors."""
    return float(np.clip(2 * math.sqrt(1.25 / (0.8 * delta_e)), 1.25, 8))


def resolution_for(sigma_b: float, delta_e: float) -> int:
    """Texels a side of the coarsest table that holds a kernel sigma_b within delta_e; even."""
    inner = math.ceil(4 * texels_per_sigma(delta_e) / sigma_b - 1e-9)
    return max(RESOLUTION_MIN, inner + inner % 2 + 2 * TILE_PADDING)


@dataclass(frozen=True)
class Plan:
    """What a bake is made from: the spectrum, the wavelengths, and the sizes that the budget chose."""

    series: SpectrumSeries
    wavelengths: np.ndarray
    sigma_b: float
    resolution: int
    terms: int


def plan(
    relief: Relief,
    coherence_length_m: float | None = None,
    delta_e: float = 1.0,
    illuminant: str = "D65",
    progress: Progress = lambda stage, fraction: None,
) -> Plan:
    """Choose kernel, resolution and terms for a relief, a coherence length in metres (None: auto) and a dE00.

    Auto takes the narrowest kernel that averages enough areas of the scan (see coherence.py), widened, if the relief
    needs many terms, until the table fits DEFAULT_BYTES. Raises GratingError if an asked length needs a finer table
    than there is."""
    auto = coherence_length_m is None
    sigma_b = coherence.narrowest_sound_kernel(relief.size_m) if auto else coherence.kernel_sigma(coherence_length_m)
    if not auto and resolution_for(sigma_b, delta_e) > RESOLUTION_MAX:
        longest = coherence.coherence_length(texels_per_sigma(delta_e) * texel_size(RESOLUTION_MAX))
        raise GratingError(
            f"coherence of {coherence_length_m * 1e6:.3g} um: finer than the largest table holds at a dE00 of "
            f"{delta_e:g}; ask for at most {math.floor(longest * 1e6)} um"
        )
    reach = max(KERNEL_REACH * sigma_b, _REACH_MIN)
    grid = frequency_grid(relief, (2 + reach) / WAVELENGTH_MIN_M, sigma_b / WAVELENGTH_MAX_M)
    s_max = 2 / WAVELENGTH_MIN_M
    series = spectrum_series(
        relief, grid, s_max, _SERIES_TOLERANCE, np.float32, lambda done, total: progress("transforms", done / total)
    )
    lambdas = bake_wavelengths(sigma_b)
    terms = choose_terms(series, lambdas, sigma_b, illuminant, delta_e)
    resolution = resolution_for(sigma_b, delta_e)
    finest = min(RESOLUTION_MAX, int(math.sqrt(DEFAULT_BYTES / (BYTES_PER_TEXEL * terms))) // 2 * 2)
    if auto and resolution > finest:
        resolution, sigma_b = finest, texels_per_sigma(delta_e) * texel_size(finest)
        lambdas = bake_wavelengths(sigma_b)
    return Plan(series, lambdas, sigma_b, resolution, terms)


def bake_wavelengths(sigma_b: float) -> np.ndarray:
    """Wavelengths (n,) equally spaced in log: at |u| = 2 a step moves an order by 1.5 sigma_b, and a Gaussian summed at
    that spacing is flat to 2 exp(-2 pi^2 / 1.5^2) = 3e-4. At least 80, for the colour matching functions."""
    step = min(1.5 * sigma_b / 2, np.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) / 80)
    count = int(np.ceil(np.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) / step)) + 1
    return np.geomspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, count)


def bake(
    relief: Relief,
    coherence_length_m: float | None = None,
    delta_e: float = 1.0,
    illuminant: str = "D65",
    progress: Progress = lambda stage, fraction: None,
) -> Bake:
    """Bake a relief for a dE00 of delta_e; see plan for the arguments and the errors raised."""
    chosen = plan(relief, coherence_length_m, delta_e, illuminant, progress)
    texel = texel_size(chosen.resolution)
    # Bilinear filtering adds a variance of texel^2 / 6 on average: bake that much narrower (halves the error).
    sigma_table = np.sqrt(chosen.sigma_b**2 - texel**2 / 6)
    axis = (np.arange(chosen.resolution) + 0.5 - chosen.resolution / 2) * texel
    nodes = chebyshev.nodes(chosen.terms, 0, 2)
    at_nodes = xyz_over_w2(chosen.series, chosen.wavelengths, nodes, axis, sigma_table, illuminant, progress)
    to_terms = chebyshev.coefficients_from_nodes(chosen.terms).astype(np.float32)
    terms = np.tensordot(to_terms, at_nodes, axes=1)
    outside = axis[:, None] ** 2 + axis[None, :] ** 2 > (2 + 2 * texel) ** 2
    terms[:, outside] = 0
    zero_order = zero_order_curve(chosen.series, illuminant)
    limit = albedo.limit_table(chosen.series, chosen.sigma_b)
    return Bake(terms, zero_order, chosen.sigma_b, texel, illuminant, limit)


def zero_order_curve(series: SpectrumSeries, illuminant: str) -> np.ndarray:
    """Z (n, 3) in XYZ at equal steps of w from 0 to 2."""
    lambdas = np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, 401)
    w = np.linspace(0, 2, ZERO_ORDER_SAMPLES)
    return series.zero_order(w[:, None] / lambdas) @ spectral_weights(lambdas, illuminant)


def choose_terms(series: SpectrumSeries, lambdas, sigma_b, illuminant, delta_e: float) -> int:
    """The fewest Chebyshev terms in w whose truncation costs at most about a fifth of the budget.

    Measured on a sample of (u, v), dense around the zero order where waviness oscillates fastest in w, and of w: the
    relative error of XYZ, its 99th percentile by scattered luminance. One percent of colour is about 0.4 dE00 (L* goes
    as the cube root: dL = 116 / 3 * 1 % at Y = 1)."""
    # More terms than the phase itself needs are never of use.
    ceiling = len(series.amplitude)
    half_axis = 1.95 * (np.arange(24) + 0.5) ** 2.5 / 24**2.5
    axis = np.concatenate([-half_axis[::-1], half_axis])
    w = chebyshev.nodes(ceiling, 0, 2)
    values = xyz_over_w2(series, lambdas[::2], w, axis, sigma_b, illuminant).astype(np.float64)
    coefficients = np.tensordot(chebyshev.coefficients_from_nodes(ceiling), values, axes=1)
    cell = np.gradient(axis)
    real = w[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2 <= 4
    share = real * values[..., 1] * w[:, None, None] ** 2 * np.outer(cell, cell) * np.gradient(w)[:, None, None]
    if share.max() <= 0:
        return 2
    basis = chebyshev.polynomials(w - 1, ceiling)
    for count in range(2, ceiling):
        error = np.tensordot(basis[:, count:], coefficients[count:], axes=1)
        relative = np.abs(error).sum(axis=-1) / np.maximum(values.sum(axis=-1), 1e-30)
        if share[relative > 0.005 * delta_e].sum() <= 0.01 * share.sum():
            return count
    return ceiling


def xyz_over_w2(series, lambdas, w_nodes, axis, sigma, illuminant, progress: Progress = lambda stage, fraction: None):
    """Scattered XYZ / w^2 at w nodes (K,) over the square grid axis x axis; (K, n, n, 3) float32."""
    weights = spectral_weights(lambdas, illuminant).astype(np.float32)
    out = np.zeros((3, len(w_nodes), len(axis), len(axis)), np.float32)
    for index, lam in enumerate(lambdas):
        resample = Resampler(series.grid, axis, axis, lam, sigma)
        node_weights = series.weights(w_nodes / lam).astype(series.scattered_over_s2.dtype) / lam**2
        spectra = np.tensordot(node_weights, series.scattered_over_s2[:, *resample.kept], axes=1)
        for k, spectrum in enumerate(spectra):
            image = resample(spectrum)
            for channel in range(3):
                out[channel, k] += weights[index, channel] * image
        progress("wavelengths", (index + 1) / len(lambdas))
    return np.moveaxis(out, 0, -1)
