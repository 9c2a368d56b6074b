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
from itertools import islice

import numpy as np

from . import albedo, budget, chebyshev, coherence
from .colour import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, spectral_weights
from .failure import GratingError
from .needs import EVERYTHING, Needs
from .relief import Relief
from .resample import KERNEL_REACH, Resampler
from .series import SpectrumSeries, fast_series

RESOLUTION_MIN, RESOLUTION_MAX = 256, 2048
# A window under a wavelength is no window of a wave: its kernel would be as wide as the hemisphere.
SHORTEST_COHERENCE_M = coherence.REFERENCE_WAVELENGTH_M
TILE_PADDING = 2
# The curve of the zero order lies in one row of the atlas.
ZERO_ORDER_SAMPLES = 2 * RESOLUTION_MIN
STRIP_ROWS = 4
# A picture's side that every graphics card of today takes.
PICTURE_SIDE_MAX = 16384
# Its longer side over the shorter: seven times was off by 4 % of the light in EEVEE (software rasteriser, Mesa), by
# 0.2 % at twice, by filtering.
ASPECT_MAX = 3.0
# What a bake may take in Blender unless a coherence length is asked for; a packed picture is held as RGBA of 32 bits.
DEFAULT_BYTES = 128 << 20
BYTES_PER_TEXEL = 16
# Texels to a sigma that hold a dE00 of 1 on any surface, ideal line gratings included.
_TEXELS_ALWAYS = 2.5
# Bins this far past |u| = 2 are kept, so that the kernel may still be widened.
_REACH_MIN = 0.15
# Of the light, for a dE00 of 1: a bin may be off by more where it is dark, 2e-4 is a hundredth of what shows.
_SERIES_TOLERANCE = 2e-4
# Wavelengths summed into the table at once, and rows of it: what a core's cache holds.
_WAVELENGTHS_AT_ONCE, _ROWS_AT_ONCE = 8, 16
_BINS_AT_ONCE = 1 << 23
# Places of the table that are read at once: what a core's cache holds of their indices and weights.
_READ_AT_ONCE = 8192

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Bake:
    """A relief's table: `terms` (K, rows, columns, 3) float32 holds B_k in XYZ, row along +v, column along +u; the
    middle of texel (row, column) is at `first` (v, u) + (row, column) * texel, by default about (0, 0); T_k is over
    `w_range`. `zero_order` (n, 3) is Z at n equal steps of w from 0 to 2, ends included. `limit` (rows, columns)
    float32 is the excess albedo that albedo.py tells of; without one, Stam's form is kept. `precision` is the float
    that holds the terms well enough in a file."""

    terms: np.ndarray
    zero_order: np.ndarray
    sigma_b: float
    texel: float
    illuminant: str
    limit: np.ndarray = field(default_factory=albedo.NO_LIMIT.copy)
    first: tuple[float, float] | None = None
    w_range: tuple[float, float] = (0.0, 2.0)
    precision: type = np.float16

    def __post_init__(self):
        if self.first is None:
            object.__setattr__(self, "first", tuple((1 - n) / 2 * self.texel for n in self.terms.shape[1:3]))

    @property
    def tile(self) -> tuple[int, int]:
        """Rows and columns of a term's tile."""
        return self.terms.shape[1:3]

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """v (rows,) and u (columns,) of the texels' middles."""
        return tuple(first + np.arange(n) * self.texel for first, n in zip(self.first, self.tile, strict=True))

    def scattered_over_w2(self, u: np.ndarray, v: np.ndarray, w) -> np.ndarray:
        """Scattered XYZ over w^2 (n, 3) at u, v (n,), read as a renderer reads it: bilinear, half floats as stored;
        what lies outside the table is its rim."""
        w = np.broadcast_to(np.asarray(w, float), np.shape(u))
        out = np.empty((3, len(u)))
        for start in range(0, len(u), _READ_AT_ONCE):
            part = slice(start, start + _READ_AT_ONCE)
            self._read(u[part], v[part], w[part], out[:, part])
        return out.T

    def _read(self, u: np.ndarray, v: np.ndarray, w: np.ndarray, out: np.ndarray) -> None:
        """Into out (3, n). Each channel is one sum over terms and corners, in the table's own precision."""
        rows, columns = self.tile
        x = np.minimum(np.maximum((u - self.first[1]) / self.texel, 0), columns - 1)
        y = np.minimum(np.maximum((v - self.first[0]) / self.texel, 0), rows - 1)
        x0, y0 = (np.minimum(c.astype(np.intp), n - 2) for c, n in ((x, columns), (y, rows)))
        precision = self.terms.dtype
        fx, fy = (x - x0).astype(precision), (y - y0).astype(precision)
        corners = np.stack([(1 - fy) * (1 - fx), (1 - fy) * fx, fy * (1 - fx), fy * fx])
        low, high = self.w_range
        t = np.clip((2 * w - low - high) / (high - low), -1, 1).astype(precision)
        weights = np.concatenate([term * corners for term in islice(chebyshev.recurrence(t), len(self.terms))])
        # Places of the X of every texel that counts, in the table laid out flat; Y and Z follow it.
        tiles = np.arange(len(self.terms))[:, None] * (rows * columns)
        places = 3 * (tiles + [0, 1, columns, columns + 1]).reshape(-1, 1) + 3 * (y0 * columns + x0)
        flat = self.terms.reshape(-1)
        for c in range(3):
            # All places are within the table, and wrapping is what NumPy checks fastest.
            out[c] = np.einsum("mn,mn->n", weights, flat[c:].take(places, mode="wrap"))

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


def resolution_for(sigma_b: float, texels_per_sigma: float) -> int:
    """Texels a side of the coarsest whole table that gives a kernel sigma_b so many texels; even."""
    inner = math.ceil(4 * texels_per_sigma / sigma_b - 1e-9)
    return max(RESOLUTION_MIN, inner + inner % 2 + 2 * TILE_PADDING)


def tile_block(terms: int, tile: tuple[int, int], width_min: int = ZERO_ORDER_SAMPLES) -> tuple[int, int]:
    """Rows and columns of tiles in the atlas: the fewest places, then the squarest picture, at least width_min texels
    wide, such that a graphics card takes it, and none much longer than wide if that can be."""
    blocks = []
    for columns in range(math.ceil(width_min / tile[1]), PICTURE_SIDE_MAX // tile[1] + 1):
        rows = math.ceil(terms / columns)
        long, short = sorted((rows * tile[0], columns * tile[1]))[::-1]
        if long <= PICTURE_SIDE_MAX:
            blocks.append((max(long / short, ASPECT_MAX), rows * columns, long / short, rows, columns))
    if not blocks:
        raise GratingError(
            f"a table of {terms} tiles of {tile[1]} x {tile[0]}: larger than a graphics card takes; ask for a shorter "
            "--coherence-um"
        )
    return min(blocks)[3:]


def blender_bytes(terms: int, tile: tuple[int, int]) -> int:
    """What the atlas of a table takes in Blender."""
    rows, columns = tile_block(terms, tile)
    return BYTES_PER_TEXEL * columns * tile[1] * (rows * tile[0] + STRIP_ROWS + albedo.LIMIT_ROWS)


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
    texels = min(_TEXELS_ALWAYS / math.sqrt(delta_e), budget.TEXELS_MAX)
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
    while blender_bytes(terms, (finest, finest)) > DEFAULT_BYTES and finest > RESOLUTION_MIN:
        finest -= 2
    if not auto and resolution > RESOLUTION_MAX:
        raise _too_fine(coherence_length_m, delta_e)
    if auto and resolution > finest:
        resolution, sigma_b = finest, texels * texel_size(finest)
        lambdas = bake_wavelengths(sigma_b, delta_e, needs.reach)
    texel = texel_size(resolution)
    axes = tuple(_texel_middles(*side, texel) for side in (needs.v, needs.u))
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


def _texel_middles(low: float, high: float, texel: float) -> np.ndarray:
    """Middles of the texels that cover [low, high], and TILE_PADDING more at each end."""
    inner = math.ceil((high - low) / texel - 1e-9)
    return (low + high) / 2 + (np.arange(inner + 2 * TILE_PADDING) - (inner + 2 * TILE_PADDING - 1) / 2) * texel


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
    # Bilinear filtering adds a variance of texel^2 / 6 on average: bake that much narrower (halves the error).
    sigma_table = math.sqrt(chosen.sigma_b**2 - chosen.texel**2 / 6)
    nodes = chebyshev.nodes(chosen.terms, *chosen.w_range)
    at_nodes = xyz_over_w2(chosen, nodes, sigma_table, illuminant, progress)
    to_terms = chebyshev.coefficients_from_nodes(chosen.terms).astype(np.float32)
    terms = np.tensordot(to_terms, at_nodes, axes=1)
    v, u = chosen.axes
    terms[:, v[:, None] ** 2 + u**2 > (2 + 2 * chosen.texel) ** 2] = 0
    zero_order = zero_order_curve(chosen.ensemble, illuminant)
    limit = np.mean([albedo.limit_table(series, chosen.sigma_b) for series in chosen.ensemble], axis=0)
    return Bake(
        terms, zero_order, chosen.sigma_b, chosen.texel, illuminant, limit.astype(np.float32), (v[0], u[0]),
        chosen.w_range, chosen.precision,
    )  # fmt: skip


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
    radius = 2 + 3 * chosen.texel
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
