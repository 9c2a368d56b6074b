# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake: everything a material needs of a relief, in one table over (u, v) and a few terms in w.

    XYZ(u, v, w) = Z(w) * kernel(u, v) + w^2 * sum_k T_k(t) B_k(u, v),   t from -1 to 1 over the range of w   (DESIGN 2)

Per wavelength the spectrum at each w node is blurred and resampled onto (u, v) by two banded matrix products (the
kernel is separable and fixed in (u, v), so a wavelength only stretches the bins it acts on), weighted by the observer
and added up; a cosine transform over the nodes gives the B_k. Several scans of one skin are averaged: every step is
linear in the spectrum.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from . import albedo, bspline, budget, chebyshev, coherence, tiling
from .colour import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, spectral_weights
from .failure import GratingError
from .needs import EVERYTHING, Needs
from .relief import Relief
from .resample import KERNEL_REACH, Resampler
from .series import SpectrumSeries, fast_series
from .tiling import BYTES_PER_TEXEL, TILE_PADDING

RESOLUTION_MIN, RESOLUTION_MAX = 64, 2048
# A window under a wavelength is no window of a wave: its kernel would be as wide as the hemisphere.
SHORTEST_COHERENCE_M = coherence.REFERENCE_WAVELENGTH_M
# The curve of the zero order lies in one row of the atlas, in the middle of so many alike.
ZERO_ORDER_SAMPLES = 512
STRIP_ROWS = 4
# What a bake may take in Blender unless a coherence length is asked for.
DEFAULT_BYTES = 128 << 20
# Texels to a sigma that hold a dE00 of 1 on any surface, ideal line gratings included.
_TEXELS_ALWAYS = 1.2
# Texels past |(u, v)| = 2 that a reading there meets: less than two along each axis.
_RIM = 3
# Bins this far past |u| = 2 are kept, so that the kernel may still be widened.
_REACH_MIN = 0.15
# Of the light, for a dE00 of 1: a bin may be off by more where it is dark, 2e-4 is a hundredth of what shows.
_SERIES_TOLERANCE = 2e-4
# Wavelengths summed into the table at once, and rows of it: what a core's cache holds.
_WAVELENGTHS_AT_ONCE, _ROWS_AT_ONCE = 8, 16
_BINS_AT_ONCE = 1 << 23
# Places of the table that are read at once: what a core's cache holds of their indices and weights.
_READ_AT_ONCE = 4096

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Bake:
    """A relief's table: `terms` (K, rows, columns, 3) float32 holds B_k in XYZ, row along +v, column along +u; the
    middle of texel (row, column) is at `first` (v, u) + (row, column) * texel, by default about (0, 0); T_k is over
    `w_range`. The outermost TILE_PADDING texels on each side are only for reading. `zero_order` (n, 3) is Z at n equal
    steps of w from 0 to 2, ends included. `limit` (rows, columns) float32 is the excess albedo that albedo.py tells of;
    without one, Stam's form is kept. `precision` is the float that holds the terms well enough in a file.
    `wider` are the same terms under kernels of 2, 4, ... sigma_b, at texels 2, 4, ... times as large (tiling.py)."""

    terms: np.ndarray
    zero_order: np.ndarray
    sigma_b: float
    texel: float
    illuminant: str
    limit: np.ndarray = field(default_factory=albedo.NO_LIMIT.copy)
    first: tuple[float, float] | None = None
    w_range: tuple[float, float] = (0.0, 2.0)
    precision: type = np.float16
    wider: tuple[np.ndarray, ...] = ()

    def __post_init__(self):
        if self.first is None:
            object.__setattr__(self, "first", tuple((1 - n) / 2 * self.texel for n in self.terms.shape[1:3]))

    @property
    def tile(self) -> tuple[int, int]:
        """Rows and columns of a term's tile."""
        return self.terms.shape[1:3]

    @property
    def levels(self) -> tuple[np.ndarray, ...]:
        """The terms of every level, level l under the kernel sigma_b 2^l."""
        return self.terms, *self.wider

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """v (rows,) and u (columns,) of the texels' middles."""
        return tuple(first + np.arange(n) * self.texel for first, n in zip(self.first, self.tile, strict=True))

    @property
    def inner(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The ranges of u and of v that the table holds; what lies outside is read at its rim."""
        return inner_ranges(self.axes)

    def scattered_over_w2(self, u: np.ndarray, v: np.ndarray, w, variance=0.0) -> np.ndarray:
        """Scattered XYZ over w^2 (n, 3) at u, v (n,), read as a renderer reads it: by cubic B-splines, half floats as
        stored. `variance` (n,) in (u, v) is added to the kernel's by mixing the two levels around it, as far as there
        are any."""
        w, variance = (np.broadcast_to(np.asarray(each, float), np.shape(u)) for each in (w, variance))
        level, share = level_mix(variance / self.sigma_b**2, len(self.levels))
        out = np.zeros((3, len(u)))
        for which in range(len(self.levels)):
            part = np.where(level == which, 1 - share, np.where(level == which - 1, share, 0.0))
            lit = np.flatnonzero(part)
            for start in range(0, len(lit), _READ_AT_ONCE):
                at = lit[start : start + _READ_AT_ONCE]
                out[:, at] += part[at] * self._read(which, u[at], v[at], w[at])
        return out.T

    def _read(self, level: int, u: np.ndarray, v: np.ndarray, w: np.ndarray) -> np.ndarray:
        """XYZ (3, n) of a level. Each channel of a term is one sum over taps, in the table's own precision."""
        terms = self.levels[level]
        _, rows, columns, _ = terms.shape
        (u_low, u_high), (v_low, v_high) = self.inner
        texel = self.texel * 2**level
        x, y = (np.clip(u, u_low, u_high) - u_low) / texel, (np.clip(v, v_low, v_high) - v_low) / texel
        places, weights = bspline.patches(y + TILE_PADDING, x + TILE_PADDING, rows, columns, terms.dtype)
        # Of the X of every texel that counts, in a term laid out flat; Y and Z follow it.
        places *= 3
        low, high = self.w_range
        t = np.clip((2 * w - low - high) / (high - low), -1, 1).astype(terms.dtype)
        out = np.zeros((3, len(u)), terms.dtype)
        for term, polynomial in zip(terms.reshape(len(terms), -1), chebyshev.recurrence(t), strict=False):
            for c in range(3):
                # All places are within the term, and wrapping is what NumPy checks fastest.
                out[c] += polynomial * np.einsum("mn,mn->n", weights, term[c:].take(places, mode="wrap"))
        return out

    def zero_order_xyz(self, w) -> np.ndarray:
        """Z (..., 3) at w (...,), read as a renderer reads it: by a cubic B-spline."""
        z = self.zero_order
        # Left of the picture is its first texel. What the B-spline smooths off is Z'' h^2 / 6.
        around = np.concatenate([z[:1], z, past_end(z)[None]])
        return bspline.read_curve(around, np.asarray(w, float) / 2 * (len(z) - 1) + 1)

    def kernel(self, u: np.ndarray, v: np.ndarray, variance=0.0) -> np.ndarray:
        """The coherence kernel (n,) that carries the zero order, wider by a variance in (u, v)."""
        variance = self.sigma_b**2 + variance
        return np.exp(-(u**2 + v**2) / (2 * variance)) / (2 * np.pi * variance)

    def limit_at(self, directions: np.ndarray) -> np.ndarray:
        """max(1, albedo) (...,) for directions (..., 3): the energy-conserving form divides f by the greater of the
        light's and the view's."""
        return albedo.limit(self.limit, directions)

    def candidate(self, u, v, w) -> tuple[np.ndarray, np.ndarray]:
        """The bake as metric.measure wants it."""
        return self.scattered_over_w2(u, v, w), self.zero_order_xyz(w)


def inner_ranges(axes: tuple[np.ndarray, np.ndarray]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Of a tile whose texels' middles are at v, u: the first and the last u, then v, that are not padding."""
    v, u = (axis[[TILE_PADDING, -1 - TILE_PADDING]] for axis in axes)
    return tuple(u.tolist()), tuple(v.tolist())


def level_mix(added, levels: int) -> tuple[np.ndarray, np.ndarray]:
    """The level (n,) under a kernel whose variance is larger by added (n,) times sigma_b^2, and the share (n,) of the
    level after it: the mixture of both has that variance. Beyond the last level, the last."""
    grown = np.clip(1 + np.asarray(added, float), 1, 4.0 ** (levels - 1))
    level = np.minimum(np.log2(grown) / 2, max(levels - 2, 0)).astype(int)
    return level, (grown / 4.0**level - 1) / 3


def past_end(curve: np.ndarray) -> np.ndarray:
    """What stands after the last sample (channels,) of a curve (n, channels), in line with its last two."""
    return 2 * curve[-1] - curve[-2]


def texel_size(resolution: int) -> float:
    """Step in u of a tile whose inner texels' middles cover [-2, 2]."""
    return 4 / (resolution - 2 * TILE_PADDING - 1)


def resolution_for(sigma_b: float, texels_per_sigma: float) -> int:
    """Texels a side of the coarsest whole table that gives a kernel sigma_b so many texels; even."""
    count = math.ceil(4 * texels_per_sigma / sigma_b - 1e-9) + 1 + 2 * TILE_PADDING
    return max(RESOLUTION_MIN, count + count % 2)


def blender_bytes(terms: int, tile: tuple[int, int], sigma_b: float) -> int:
    """What the atlas of a table takes in Blender."""
    inner = tuple(n - 2 * TILE_PADDING for n in tile)
    levels = tiling.level_count(sigma_b, inner)
    stride, width_min = tiling.first_stride(inner, levels), ZERO_ORDER_SAMPLES + 1
    block = tiling.tile_block(terms, stride, levels, width_min)
    height, width = tiling.blocks_size(block, stride, levels)
    return BYTES_PER_TEXEL * (height + STRIP_ROWS + albedo.LIMIT_ROWS + 2) * max(width, width_min)


@dataclass(frozen=True)
class Plan:
    """What a bake is made from: spectra, wavelengths, kernel, the texels' middles along v and u, terms in w, and the
    float that holds those."""

    ensemble: tuple[SpectrumSeries, ...]
    wavelengths: np.ndarray
    sigma_b: float
    texel: float
    axes: tuple[np.ndarray, np.ndarray]
    terms: int
    w_range: tuple[float, float]
    precision: type

    @property
    def inner(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The ranges of u and of v that the table holds."""
        return inner_ranges(self.axes)

    @property
    def texels_per_sigma(self) -> float:
        return self.sigma_b / self.texel


def kernel_for(
    reliefs: Sequence[Relief], coherence_length_m: float | None = None, delta_e: float = 1.0, needs: Needs = EVERYTHING
) -> float:
    """The kernel sigma_b that a bake begins with: the asked coherence's, or the narrowest that averages enough areas of
    all scans (see coherence.py), or what the scene's lights and pixels blur anyway.

    Raises GratingError for a length that no scan, no light or no table has."""
    held = min(_longest_coherence(relief) for relief in reliefs)
    if coherence_length_m is None:
        length_m = min(coherence.longest_sound_length(*extent(reliefs)), held)
        if length_m < SHORTEST_COHERENCE_M and held < math.inf:
            raise GratingError(
                f"the scan, {_sides(reliefs)} um, is too small to average {coherence.MINIMUM_AREAS} coherence areas of "
                "a wavelength; give a larger one, or several"
            )
        return max(coherence.kernel_sigma(max(length_m, SHORTEST_COHERENCE_M)), needs.kernel)
    asked = f"coherence of {coherence_length_m * 1e6:.3g} um"
    if coherence_length_m < SHORTEST_COHERENCE_M:
        raise GratingError(f"{asked}: shorter than a wavelength; ask for at least {SHORTEST_COHERENCE_M * 1e6:g} um")
    if coherence_length_m > held * (1 + 1e-9):
        raise GratingError(
            f"{asked}: longer than the scan, {_sides(reliefs)} um, of which it would be one speckle; ask for at most "
            f"{math.floor(held * 1e8) / 100:g} um, or give a larger scan"
        )
    sigma_b = max(coherence.kernel_sigma(coherence_length_m), needs.kernel)
    if resolution_for(sigma_b, budget.TEXELS_MIN) > RESOLUTION_MAX:
        raise _too_fine(coherence_length_m, delta_e)
    return sigma_b


def extent(reliefs: Sequence[Relief]) -> tuple[float, float]:
    """Area of all scans, and length of those that are profiles: a single row or column does not change across."""
    area = sum(math.prod(relief.size_m) for relief in reliefs if 1 not in relief.height_m.shape)
    return area, sum(max(_changing_sides(relief), default=0.0) for relief in reliefs if 1 in relief.height_m.shape)


def _changing_sides(relief: Relief) -> list[float]:
    return [side for side, count in zip(relief.size_m, relief.height_m.shape, strict=True) if count > 1]


def _longest_coherence(relief: Relief) -> float:
    """Of a surface that wraps, any; else the scan's shorter side."""
    return math.inf if relief.periodic else min(_changing_sides(relief), default=0.0)


def _sides(reliefs: Sequence[Relief]) -> str:
    smallest = min(reliefs, key=_longest_coherence)
    return " x ".join(f"{side * 1e6:.3g}" for side in smallest.size_m[::-1])


def _too_fine(coherence_length_m: float, delta_e: float) -> GratingError:
    texels = min(_TEXELS_ALWAYS / delta_e**0.25, budget.TEXELS_MAX)
    longest = coherence.coherence_length(max(texels, budget.TEXELS_MIN) * texel_size(RESOLUTION_MAX))
    return GratingError(
        f"coherence of {coherence_length_m * 1e6:.3g} um: finer than the largest table holds at a dE00 of "
        f"{delta_e:g}; ask for at most {math.floor(longest * 1e6)} um"
    )


def plan(
    reliefs: Relief | Sequence[Relief],
    coherence_length_m: float | None = None,
    delta_e: float = 1.0,
    illuminant: str = "D65",
    needs: Needs = EVERYTHING,
    progress: Progress = lambda stage, fraction: None,
    finer: float = 1.0,
) -> Plan:
    """Choose kernel, texels and terms for reliefs, a coherence length in metres (None: auto) and a dE00.

    An automatic kernel is widened until the table fits DEFAULT_BYTES. Texels are `finer` times as many as measured.
    Raises GratingError if an asked length needs a finer table than there is."""
    reliefs = (reliefs,) if isinstance(reliefs, Relief) else tuple(reliefs)
    auto = coherence_length_m is None
    sigma_b = kernel_for(reliefs, coherence_length_m, delta_e, needs)
    if auto:  # what no table of that size holds anyway need not be resolved
        sigma_b = max(sigma_b, budget.TEXELS_MIN * texel_size(int(math.sqrt(DEFAULT_BYTES / BYTES_PER_TEXEL / 4))))
    ensemble = _spectra(reliefs, sigma_b, delta_e, needs, progress)
    lambdas = bake_wavelengths(sigma_b, delta_e, needs.reach)
    probe = budget.probe(ensemble, sigma_b, lambdas[::2], illuminant, needs)
    terms = probe.terms(delta_e)
    texels = min(finer * probe.texels_per_sigma(delta_e), budget.TEXELS_MAX)
    resolution = resolution_for(sigma_b, texels)
    finest = min(RESOLUTION_MAX, int(math.sqrt(DEFAULT_BYTES / (BYTES_PER_TEXEL * terms))) // 2 * 2)
    while (
        blender_bytes(terms, (finest, finest), texels * texel_size(finest)) > DEFAULT_BYTES and finest > RESOLUTION_MIN
    ):
        finest -= 2
    if not auto and resolution > RESOLUTION_MAX:
        raise _too_fine(coherence_length_m, delta_e)
    if auto and resolution > finest:
        resolution, sigma_b = finest, texels * texel_size(finest)
        lambdas = bake_wavelengths(sigma_b, delta_e, needs.reach)
    texel = texel_size(resolution)
    axes = tuple(texel_middles(*side, texel) for side in (needs.v, needs.u))
    precision = np.float16 if probe.halves_do(terms, delta_e) else np.float32
    return Plan(ensemble, lambdas, sigma_b, texel, axes, terms, needs.w, precision)


def _spectra(reliefs, sigma_b, delta_e, needs, progress) -> tuple[SpectrumSeries, ...]:
    reach = max(KERNEL_REACH * sigma_b, _REACH_MIN)
    found = []
    for k, relief in enumerate(reliefs):

        def tick(done, total, k=k):
            progress("transforms", (k + done / total) / len(reliefs))

        found.append(
            fast_series(
                relief, (needs.reach + reach) / WAVELENGTH_MIN_M, needs.w[1] / WAVELENGTH_MIN_M,
                sigma_b / WAVELENGTH_MAX_M, _SERIES_TOLERANCE * delta_e, tick,
            )
        )  # fmt: skip
    return tuple(found)


def texel_middles(low: float, high: float, texel: float) -> np.ndarray:
    """Middles of the texels from low to high, or from as little outside, and TILE_PADDING more at each end."""
    count = math.ceil((high - low) / texel - 1e-9) + 1 + 2 * TILE_PADDING
    return (low + high) / 2 + (np.arange(count) - (count - 1) / 2) * texel


def bake_wavelengths(sigma_b: float, delta_e: float = 1.0, reach: float = 2.0) -> np.ndarray:
    """Wavelengths (n,) equally spaced in log: at |u| = reach a step moves an order by f sigma_b, and a Gaussian summed
    at that spacing is flat to 2 exp(-2 pi^2 / f^2), which is put at 0.1 % for a dE00 of 1. At least 80, for the colour
    matching functions."""
    spacing = math.pi * math.sqrt(2 / math.log(2 / min(1e-3 * delta_e, 0.1)))
    step = min(spacing * sigma_b / reach, np.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) / 80)
    count = int(np.ceil(np.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) / step)) + 1
    return np.geomspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, count)


def bake(
    reliefs: Relief | Sequence[Relief],
    coherence_length_m: float | None = None,
    delta_e: float = 1.0,
    illuminant: str = "D65",
    needs: Needs = EVERYTHING,
    progress: Progress = lambda stage, fraction: None,
) -> Bake:
    """Bake reliefs for a dE00 of delta_e; see plan for the arguments and the errors raised."""
    return carry_out(plan(reliefs, coherence_length_m, delta_e, illuminant, needs, progress), illuminant, progress)


def carry_out(chosen: Plan, illuminant: str = "D65", progress: Progress = lambda stage, fraction: None) -> Bake:
    """The bake that a plan describes."""
    sigma_table = narrower(chosen.sigma_b, chosen.texel)
    nodes = chebyshev.nodes(chosen.terms, *chosen.w_range)
    at_nodes = xyz_over_w2(chosen, nodes, sigma_table, illuminant, progress)
    to_terms = chebyshev.coefficients_from_nodes(chosen.terms).astype(np.float32)
    terms = np.tensordot(to_terms, at_nodes, axes=1)
    v, u = chosen.axes
    terms[:, v[:, None] ** 2 + u**2 > (2 + _RIM * chosen.texel) ** 2] = 0
    zero_order = zero_order_curve(chosen.ensemble, illuminant)
    limit = np.mean([albedo.limit_table(series, chosen.sigma_b) for series in chosen.ensemble], axis=0)
    return Bake(
        terms, zero_order, chosen.sigma_b, chosen.texel, illuminant, limit.astype(np.float32), (v[0], u[0]),
        chosen.w_range, chosen.precision, wider_levels(terms, (v, u), chosen.sigma_b, chosen.texel),
    )  # fmt: skip


def narrower(sigma: float, texel: float) -> float:
    """The kernel to sample so that a reading, which widens it by the B-spline, has sigma."""
    return math.sqrt(sigma**2 - bspline.VARIANCE * texel**2)


def wider_levels(terms: np.ndarray, axes, sigma_b: float, texel: float) -> tuple[np.ndarray, ...]:
    """Levels 1, 2, ... of terms (K, rows, columns, 3) whose texels' middles are at axes v, u.

    What a table that ends at |u| = 2 does not hold is nothing; a region's rim goes on as it is."""
    whole = [low <= 1e-9 - 2 and high >= 2 - 1e-9 for low, high in inner_ranges(axes)[::-1]]
    modes = ["constant" if each else "edge" for each in whole]
    levels = tiling.level_count(sigma_b, tuple(len(axis) - 2 * TILE_PADDING for axis in axes))
    # Each level's sampled kernel is twice as wide as the one's before: 3 times its variance is to be added.
    sigma = math.sqrt(3) * narrower(sigma_b, texel) / texel
    found = [terms]
    for _ in range(levels - 1):
        rows = _halved(found[-1], sigma, modes[0])
        found.append(_halved(rows.swapaxes(1, 2), sigma, modes[1]).swapaxes(1, 2))
    return tuple(np.ascontiguousarray(level) for level in found[1:])


def _halved(terms: np.ndarray, sigma: float, mode: str) -> np.ndarray:
    """Terms (K, rows, ...) under a Gaussian of sigma texels along the rows, at every second inner row."""
    inner = len(terms[0]) - 2 * TILE_PADDING
    (count,) = tiling.level_inner((inner,), 1)
    count += 2 * TILE_PADDING
    reach = math.ceil(KERNEL_REACH * sigma)
    gaussian = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    gaussian = (gaussian / gaussian.sum()).astype(terms.dtype)
    # Row i stands at row 2 (i - padding) + padding of what it is made from, which thus begins at -padding.
    after = 2 * (count - 1) - TILE_PADDING - (len(terms[0]) - 1) + reach
    padding = [(0, 0), (TILE_PADDING + reach, after)] + [(0, 0)] * (terms.ndim - 2)
    wide = np.pad(terms, padding, mode=mode)
    return sum(share * wide[:, k : k + 2 * count - 1 : 2] for k, share in enumerate(gaussian))


def zero_order_curve(ensemble: Sequence[SpectrumSeries], illuminant: str) -> np.ndarray:
    """Z (n, 3) in XYZ at equal steps of w from 0 to 2."""
    lambdas = np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, 401)
    s = np.linspace(0, 2, ZERO_ORDER_SAMPLES)[:, None] / lambdas
    return sum(series.zero_order(s) for series in ensemble) @ spectral_weights(lambdas, illuminant) / len(ensemble)


def xyz_over_w2(chosen: Plan, w_nodes, sigma, illuminant, progress: Progress = lambda stage, fraction: None):
    """Scattered XYZ / w^2 (K, rows, columns, 3) float32 at w nodes (K,) over the plan's texels."""
    v, u = chosen.axes
    lambdas = chosen.wavelengths
    weights = (spectral_weights(lambdas, illuminant) / len(chosen.ensemble)).astype(np.float32)
    out = np.zeros((len(w_nodes), len(v), 3, len(u)), np.float32)
    radius = 2 + _RIM * chosen.texel
    images = np.empty((len(w_nodes), len(v), _WAVELENGTHS_AT_ONCE, len(u)), np.float32)
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
                        images[first + k, :, g] = resample(spectra[:, k])
            count = group.stop - group.start
            for tile, image in zip(out, images, strict=True):
                for row in range(0, len(v), _ROWS_AT_ONCE):
                    rows = slice(row, row + _ROWS_AT_ONCE)
                    tile[rows] += weights[group].T @ image[rows, :count]
            done += count
            progress("wavelengths", done / (len(lambdas) * len(chosen.ensemble)))
    return np.moveaxis(out, 2, -1)
