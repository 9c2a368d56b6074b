# SPDX-License-Identifier: GPL-3.0-or-later
"""Interpolates the scattered spectrum at every s from a few values of s (docs/theory.md, Expansions).

Let P be the transform of the phasor at s, and h and h' the heights of two pixels. |P|^2 is a sum of terms exp(-i 2 pi s
(h - h')). So the range of the relief limits its band in s, and a few Chebyshev nodes suffice. The scattered part
vanishes as s^2. The series holds the spectrum divided by s^2, which stays well conditioned at grazing angles.

A surface may lie in many directions. Its mean spectrum is its power averaged over turns about q = 0. A turned surface
has the turned spectrum, so the mean over turns is a blur along rings. The rings are sampled as finely as the bins, by
cubic convolution. The blur is a product of transforms along each ring.

For a bake, the series is computed in single precision, with as few nodes as the relief needs. Each node in s costs a
transform. `bound` gives a number of nodes that is enough for every relief of the same height range, about twice what a
real scan needs. So `fast_series` measures the number on small cuts of the relief, then confirms it on the whole
relief."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base.failure import GratingError
from ..base.progress import Progress, silent
from ..maths import chebyshev
from ..surface.height_map import read_between
from ..surface.relief import Relief
from .spectrum import (
    FrequencyGrid,
    frequency_grid,
    kept_bins,
    power_of_rows,
    row_blocks,
    scattered_spectrum,
    zero_order_amplitude,
)

_ROWS_AT_ONCE = 128


def over_turns(power: np.ndarray, grid: FrequencyGrid, radians: float) -> np.ndarray:
    """The mean of the power (ny, nx) on a grid's bins over normally distributed turns of standard deviation `radians`.

    The sum and the kind of float stay. Bins beyond the largest ring on the grid stay, too."""
    sides = grid.q_y, grid.q_x
    step = min(float(q[1] - q[0]) for q in sides)
    reach = min(float(-q[0]) for q in sides)
    radii = np.arange(int(reach / step) + 1) * step
    angles = np.linspace(0, 2 * np.pi, math.ceil(2 * np.pi * len(radii)), endpoint=False)
    fall = np.exp(-0.5 * (np.arange(len(angles) // 2 + 1) * radians) ** 2).astype(np.float32)
    rings = np.empty((len(radii), len(angles)), np.float32)
    for part in _parts(len(radii)):
        turned = (radii[part, None] * wave for wave in (np.sin(angles), np.cos(angles)))
        sampled = read_between(power, *((at - q[0]) / (q[1] - q[0]) for at, q in zip(turned, sides, strict=True)))
        rings[part] = np.fft.irfft(np.fft.rfft(sampled, axis=1) * fall, len(angles), axis=1)
    # A ring closes: cubic convolution reads one column to the left, and two to the right.
    rings = np.concatenate([rings[:, -1:], rings, rings[:, :2]], axis=1)
    out = power.copy()
    for part in _parts(len(power)):
        y, x = grid.q_y[part, None], grid.q_x
        ring, angle = np.hypot(y, x) / step, np.arctan2(y, x) % (2 * np.pi)
        blurred = read_between(rings, ring, 1 + angle * (len(angles) / (2 * np.pi)))
        out[part] = np.where(ring <= len(radii) - 1, np.maximum(blurred, 0), out[part])
    total = out.sum(dtype=float)
    return out * power.dtype.type(power.sum(dtype=float) / total) if total > 0 else out


def _parts(count: int) -> list[slice]:
    return [slice(start, start + _ROWS_AT_ONCE) for start in range(0, count, _ROWS_AT_ONCE)]


# The least number of nodes.
COUNT_MIN = 4


@dataclass(frozen=True)
class SpectrumSeries:
    """The scattered spectrum divided by s^2, and the zero order's amplitude, at Chebyshev nodes in s on [0, s_max].

    grid               the bins
    s_max              the upper end of the interval, cycles per metre
    scattered_over_s2  (count, ny, nx) in square metres
    amplitude          (count,) complex
    blur_q             standard deviation of the Gaussian that already blurs the bins, cycles per metre
    periodic           True if the bins are the orders of a surface that wraps, False if they sample a continuum
    turns              standard deviation, in radians, of the turns over which the bins are averaged
    """

    grid: FrequencyGrid
    s_max: float
    scattered_over_s2: np.ndarray
    amplitude: np.ndarray
    blur_q: float = 0.0
    periodic: bool = True
    turns: float = 0.0

    def weights(self, s: np.ndarray) -> np.ndarray:
        """The nodes' weights (..., count) in the interpolation at s (...,)."""
        return chebyshev.interpolation_matrix(s, len(self.amplitude), lower=0, upper=self.s_max)

    def over_turns(self, radians: float, progress: Progress = silent) -> "SpectrumSeries":
        """The series of the surface averaged over normally distributed turns of standard deviation `radians`.

        `progress` is called after each node."""
        averaged = np.empty_like(self.scattered_over_s2)
        for k, power in enumerate(self.scattered_over_s2):
            averaged[k] = over_turns(power, self.grid, radians)
            progress("directions", (k + 1) / len(averaged))
        return replace(self, scattered_over_s2=averaged, turns=radians)

    def zero_order(self, s: np.ndarray) -> np.ndarray:
        """The efficiency (...,) of the zero order at s (...,)."""
        # tensordot makes one product of them all. Products in a stack each wake the threads of the linear algebra.
        parts = np.stack([self.amplitude.real, self.amplitude.imag], axis=-1)
        return (np.tensordot(self.weights(s), parts, axes=1) ** 2).sum(axis=-1)

    @cached_property
    def row_sums(self) -> np.ndarray:
        """The sums (count, ny) of the rows of scattered_over_s2."""
        return self.scattered_over_s2.sum(axis=2, dtype=float)

    def mixed(self, weights: np.ndarray, kept: tuple[slice, slice]) -> np.ndarray:
        """Sum scattered_over_s2 over the nodes, once per row of weights (k, count): (ny, k, nx).

        Only the bins in `kept`, slices of rows and columns, are summed."""
        rows, columns = kept
        weights = weights.astype(self.scattered_over_s2.dtype)
        return weights @ self.scattered_over_s2.transpose(1, 0, 2)[rows, :, columns]

    def kernel_left(self, sigma: float, wavelength_m: float) -> tuple[float, float]:
        """The standard deviations (along v, along u) of the kernel to apply to the bins at a wavelength, so that the
        result has the kernel sigma in (u, v)."""
        return self.grid.kernel_left(sigma, wavelength_m, blur_q=self.blur_q)


def spectrum_series(
    relief: Relief, grid: FrequencyGrid, s_max: float, *, tolerance: float, progress: Progress = silent
) -> SpectrumSeries:
    """Compute the series of a relief in float64, for s up to s_max in cycles per metre.

    Its interpolation error is at most `tolerance` times its largest value. `progress` is called after each
    transform."""
    count = bound(relief, s_max, tolerance)
    s_nodes = chebyshev.nodes(count, 0, s_max)
    scattered = np.empty((count, len(grid.q_y), len(grid.q_x)))
    amplitude = np.empty(count, complex)
    for k, s in enumerate(s_nodes):
        power, _ = scattered_spectrum(relief, s, grid)
        scattered[k] = power / s**2
        amplitude[k] = zero_order_amplitude(relief, s)
        progress("transforms", (k + 1) / count)
    return SpectrumSeries(grid, s_max, scattered, amplitude, periodic=relief.periodic)


def bound(relief: Relief, s_max: float, tolerance: float) -> int:
    """The number of nodes in s that is enough for every relief of the same height range."""
    # Let s = s_max (1 + t) / 2 with t in [-1, 1], and d the difference of two heights. Then exp(-i 2 pi s d) is exp(-i
    # z t) with z = pi s_max d, times a constant of modulus 1.
    return max(COUNT_MIN, chebyshev.jacobi_anger_terms(np.pi * s_max * relief.height_range_m, tolerance))


# The kernel ends at this many standard deviations.
KERNEL_REACH = 5.5
# Rows of the result per matrix product. A tall block multiplies many zeros, because it includes every bin that any of
# its rows reaches. A low block stays under a million multiplications, for which OpenBLAS has faster kernels, but low
# blocks need more products, and each product takes time to start.
_ROWS_PER_BLOCK = 16


class Resampler:
    """Blurs and resamples the bins of one wavelength onto the grid of u (nu,) and v (nv,), both ascending.

    The density is G_v power G_u^T with G[i, j] = N(u_i - lambda q_j; sigma), a normal density of a standard deviation
    along each axis, `sigmas` (along v, along u). `lam` is the wavelength in metres. `kept` holds the slices (rows,
    columns) of the grid's bins that the kernel reaches; a caller passes the power of these bins only. The density may
    stay 0 farther than `radius` from (0, 0)."""

    def __init__(
        self, grid: FrequencyGrid, u: np.ndarray, v: np.ndarray, lam: float, sigmas: tuple[float, float],
        radius: float = math.inf,
    ) -> None:  # fmt: skip
        reach_v, reach_u = (KERNEL_REACH * sigma for sigma in sigmas)
        sides = (lam * grid.q_y, v, reach_v), (lam * grid.q_x, u, reach_u)
        rows, columns = (slice(*np.searchsorted(q, [at[0] - reach, at[-1] + reach])) for q, at, reach in sides)
        self.kept = rows, columns
        centres = lam * grid.q_x[columns]
        self._rows = _blocks(lam * grid.q_y[rows], v, sigmas[0], across=centres, past=reach_u, radius=radius)
        self._cols = _blocks(centres, u, sigmas[1], across=v, past=0.0, radius=radius)
        self._shape = len(v), len(u)

    def __call__(self, power: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
        """The density (len(v), len(u)) of the power (ny, nx) of the kept bins; its row index runs along +v.

        `out` may hold the density. It stays as it is where the density may stay 0."""
        half = np.zeros((self._shape[0], power.shape[1]), power.dtype)
        for places, bins, across, factor in self._rows:
            np.matmul(factor.astype(power.dtype), power[bins, across], out=half[places, across])
        image = np.zeros(self._shape, power.dtype) if out is None else out
        for places, bins, across, factor in self._cols:
            np.matmul(half[across, bins], factor.T.astype(power.dtype), out=image[across, places])
        return image


def _blocks(
    centres: np.ndarray, axis: np.ndarray, sigma: float, *, across: np.ndarray, past: float, radius: float
) -> list[tuple[slice, slice, slice, np.ndarray]]:
    """The matrix G in blocks. Each has the slice of its points on the axis, the slice of the bins that the kernel
    reaches from these points, the slice of the positions `across` the axis that are at most `past` outside the disc of
    `radius` there, and this part of G. Blocks beyond the disc are left out."""
    first = np.arange(0, len(axis), _ROWS_PER_BLOCK)
    last = np.minimum(first + _ROWS_PER_BLOCK, len(axis)) - 1
    reach = KERNEL_REACH * sigma
    start, stop = np.searchsorted(centres, axis[first] - reach), np.searchsorted(centres, axis[last] + reach)
    # The longest chord that the disc cuts from the lines of a block.
    nearest = np.maximum(0, np.maximum(axis[first], -axis[last]))
    chord = np.sqrt(np.maximum(radius**2 - nearest**2, 0))
    low, high = np.searchsorted(across, -chord - past), np.searchsorted(across, chord + past)
    place = np.minimum(first[:, None] + np.arange(_ROWS_PER_BLOCK), len(axis) - 1)
    bins = np.minimum(start[:, None] + np.arange((stop - start).max()), len(centres) - 1)
    distance = (axis[place][:, :, None] - centres[bins][:, None, :]) / sigma
    # Factors beyond the reach are set to 0. Far beyond, they would be subnormal numbers in single precision, which cost
    # some processors 100 cycles per operation.
    factor = (np.abs(distance) <= KERNEL_REACH) * np.exp(-0.5 * distance**2) / (math.sqrt(2 * math.pi) * sigma)
    return [
        (slice(first[k], last[k] + 1), slice(start[k], stop[k]), slice(low[k], high[k]),
         factor[k, : last[k] + 1 - first[k], : stop[k] - start[k]])
        for k in np.flatnonzero(chord)
    ]  # fmt: skip


# Side in pixels of the cuts that measure the number of nodes. Reliefs under twice this size take it from `bound`.
_CUT = 192
# The greatest number of nodes: a depth of 60 um for all of (u, v), far beyond the validity of scalar diffraction.
_COUNT_MAX = 1000
# A smaller share of scattered light counts as rounding. It is a hundred times a transform's error in single precision.
ROUNDING = 1e-10
# Bins much finer than the finest applied kernel are blurred by a Gaussian and then thinned out. These are the blur's
# standard deviation and the new spacing of the bins, in units of this kernel at the longest wavelength. It is narrower
# than the bake's by what the apodisation window adds, along the scan's shorter side. The rest of the kernel then has a
# standard deviation of 0.8. A sum over bins under both Gaussians is flat to 2 exp(-2 pi^2 * 0.6^2 * 0.8^2 / 0.75^2) =
# 6e-4.
_BLUR, _SPACING = 0.6, 0.75


@dataclass(frozen=True)
class Work:
    """The cost of a series in single precision.

    transforms  the number of transforms
    fine_bins   the bins that are kept of each transform
    bins        the bins per transform that the series holds, thinned out or not"""

    transforms: int
    fine_bins: int
    bins: int


def unasked(work: Work) -> None:
    """Accept any cost: the default of `before`."""


def exact_error(relief: Relief, series: SpectrumSeries, s_values: np.ndarray) -> float:
    """A series' error: sum |found - exact| / sum exact over the bins, the largest over s_values (n,).

    `found` is the series' spectrum and `exact` a transform's in float64. If the bins were thinned out, the exact
    spectrum is in float32 and thinned out too. Values of s at which the relief scatters up to ROUNDING are skipped."""
    worst = 0.0
    for s in s_values:
        if series.blur_q:
            fine = kept_bins(relief, series.grid.transform_shape, series.grid.q_x[-1])
            exact = _blurred(_power(relief, s, fine)[0], fine, series.grid, blur_q=series.blur_q)
        else:
            exact, _ = scattered_spectrum(relief, s, series.grid)
        if series.turns:
            exact = over_turns(exact, series.grid, series.turns)
        found = series.mixed(series.weights(np.array([s])) * s**2, (slice(None), slice(None)))[:, 0]
        total = exact.sum(dtype=float)
        if total > ROUNDING:
            worst = max(worst, float(np.abs(found - exact).sum(dtype=float) / total))
    return worst


def fast_series(
    relief: Relief, q_max: float, s_max: float, *, finest_kernel: float, tolerance: float, progress: Progress = silent,
    before: Callable[[Work], None] = unasked,
) -> SpectrumSeries:  # fmt: skip
    """Compute the series of a relief in float32, with bins up to q_max and s up to s_max, both in cycles per metre.

    finest_kernel is the standard deviation, in cycles per metre, of the narrowest kernel that will be used. Bins much
    finer than this kernel are blurred by a part of it and thinned out. The series omits about the share `tolerance` of
    the light, estimated from its last coefficients. `before` gets the cost before the first transform and may raise
    GratingError; `progress` is called after each transform. Raises GratingError if `bound` exceeds _COUNT_MAX."""
    grid = frequency_grid(relief, q_max, finest_kernel)
    most = bound(relief, s_max, tolerance)
    if most > _COUNT_MAX:
        raise GratingError(
            "",
            f"a relief of {relief.height_range_m * 1e6:.3g} um is too deep for its spectrum",
            "give its true height, or crop what stands out, such as dust",
        )
    count = min(most, measured_count(relief, q_max, s_max, tolerance=tolerance))
    applied = min(grid.kernel_left(finest_kernel, 1.0))
    coarse = _thinned_grid(grid, applied)
    before(Work(count, *(len(each.q_y) * len(each.q_x) for each in (grid, coarse))))
    while True:
        series = _transforms(relief, grid, s_max, applied=applied, count=count, progress=progress)
        left_out, ratio = _left_out(_coefficient_sizes(series.scattered_over_s2))
        if count == most or left_out <= 2 * tolerance:
            return series
        count = min(most, count + math.ceil(2 * math.log(tolerance / left_out) / math.log(ratio)))


def measured_count(relief: Relief, q_max: float, s_max: float, *, tolerance: float) -> int:
    """The number of nodes in s that is enough for each of three cuts of the relief.

    The cuts are around the centre, the highest and the deepest point. A small relief uses `bound`. Arguments as in
    fast_series."""
    most = bound(relief, s_max, tolerance)
    rows, cols = relief.height_m.shape
    if max(rows, cols) < 2 * _CUT:
        return most
    ends = np.argmax(relief.height_m), np.argmin(relief.height_m)
    places = [(rows // 2, cols // 2), *(divmod(int(each), cols) for each in ends)]
    nodes = chebyshev.nodes(most, 0, s_max)
    counts = []
    for place in places:
        part = tuple(_slice_around(at, n) for at, n in zip(place, (rows, cols), strict=True))
        height = relief.height_m[part]
        along_y, along_x = (np.hanning(n + 2)[1:-1] if n > 1 else np.ones(1) for n in height.shape)
        cut = Relief(height, (along_y, along_x), relief.pixel_size_m, periodic=True)
        grid = frequency_grid(cut, q_max, 1.0)
        sizes = _coefficient_sizes(np.stack([_power(cut, s, grid)[0] / np.float32(s**2) for s in nodes]))
        counts.append(int(np.count_nonzero(np.cumsum(sizes[::-1])[::-1] > tolerance * sizes.sum())))
    return max(COUNT_MIN, *counts)


def _slice_around(at: int, count: int) -> slice:
    """A slice of _CUT out of `count` pixels, centred on pixel `at`, or moved inwards at the edges."""
    start = int(np.clip(at - _CUT // 2, 0, max(count - _CUT, 0)))
    return slice(start, start + min(_CUT, count))


def _coefficient_sizes(values: np.ndarray) -> np.ndarray:
    """Sizes (count,) of Chebyshev coefficients from values (count, ...) at the nodes: moduli summed over the other
    axes."""
    flat = values.reshape(len(values), -1)
    matrix = chebyshev.coefficients_from_nodes(len(values)).astype(values.dtype)
    blocks = range(0, flat.shape[1], 1 << 18)
    return sum(np.abs(matrix @ flat[:, start : start + (1 << 18)]).sum(axis=1, dtype=float) for start in blocks)


def _left_out(sizes: np.ndarray) -> tuple[float, float]:
    """Estimate the share of light in the coefficients after the last, from sizes (count,).

    Even and odd coefficients each fall at least geometrically (Jacobi-Anger). The estimate sums this geometric series,
    whose ratio is the size of the last two coefficients over that of the two before. Returns the share and the
    ratio."""
    before, last = sizes[-4:-2].sum(), sizes[-2:].sum()
    ratio = min(last / max(before, 1e-300), 0.5)
    return last * ratio / (1 - ratio) / max(sizes.sum(), 1e-300), max(ratio, 1e-6)


def _transforms(
    relief: Relief, grid: FrequencyGrid, s_max: float, *, applied: float, count: int, progress: Progress
) -> SpectrumSeries:
    """Compute the series of `count` nodes. Bins much finer than the finest applied kernel are thinned out."""
    coarse = _thinned_grid(grid, applied)
    blur_q = 0.0 if coarse is grid else _BLUR * applied
    scattered = np.empty((count, len(coarse.q_y), len(coarse.q_x)), np.float32)
    amplitude = np.empty(count, complex)
    for k, s in enumerate(chebyshev.nodes(count, 0, s_max)):
        power, amplitude[k] = _power(relief, s, grid)
        power /= np.float32(s**2)
        scattered[k] = power if coarse is grid else _blurred(power, grid, coarse, blur_q=blur_q)
        progress("transforms", (k + 1) / count)
    return SpectrumSeries(coarse, s_max, scattered, amplitude, blur_q, relief.periodic)


def _thinned_grid(grid: FrequencyGrid, applied: float) -> FrequencyGrid:
    """A coarser grid for bins blurred by _BLUR, or the grid itself if that saves less than half of the bins."""
    spacing = _SPACING * applied
    reach = [math.ceil((q[-1] + KERNEL_REACH * _BLUR * applied) / spacing) for q in (grid.q_y, grid.q_x)]
    if np.prod([2 * n + 1 for n in reach]) > 0.5 * len(grid.q_y) * len(grid.q_x):
        return grid
    q_y, q_x = (np.arange(-n, n + 1) * spacing for n in reach)
    return replace(grid, q_y=q_y, q_x=q_x)


def _blurred(power: np.ndarray, grid: FrequencyGrid, coarse: FrequencyGrid, *, blur_q: float) -> np.ndarray:
    """Blur the fine grid's power (ny, nx) by blur_q (cycles per metre) and sample it in the coarse grid's bins."""
    resample = Resampler(grid, coarse.q_x, coarse.q_y, 1.0, (blur_q, blur_q))
    return resample(power[resample.kept]) * np.float32(
        (coarse.q_y[1] - coarse.q_y[0]) * (coarse.q_x[1] - coarse.q_x[0])
    )


def _power(relief: Relief, s: float, grid: FrequencyGrid) -> tuple[np.ndarray, complex]:
    """The scattered power per bin (ny, nx) float32, and the zero order's amplitude.

    Like `scattered_spectrum`, but in single precision and by blocks. The phasor is exact to 1e-6, so rounding scatters
    1e-12 of the light, far less than the shallowest visible relief does."""
    amplitude = _mean_phasor(relief, s)
    apodisation_y, apodisation_x = (apodisation.astype(np.float32) for apodisation in relief.apodisation_axes)

    def field(part: slice) -> np.ndarray:
        cosine, sine = _phase(relief, s, part)
        rows = np.empty(cosine.shape, np.complex64)
        rows.real = cosine - np.float32(amplitude.real)
        rows.imag = -sine - np.float32(amplitude.imag)
        rows *= apodisation_y[part, None] * apodisation_x
        return rows

    return power_of_rows(field, relief, grid, precision=np.float32), amplitude


def _mean_phasor(relief: Relief, s: float) -> complex:
    """Like `zero_order_amplitude`, from phasors in single precision."""
    weights_y, weights_x = (apodisation**2 / np.sum(apodisation**2) for apodisation in relief.apodisation_axes)
    total = 0j
    for part in row_blocks(relief):
        cosine, sine = _phase(relief, s, part)
        total += weights_y[part] @ (cosine @ weights_x - 1j * (sine @ weights_x))
    return complex(total)


def _phase(relief: Relief, s: float, part: slice) -> tuple[np.ndarray, np.ndarray]:
    """The cosine and sine (n, cols) float32 of 2 pi s h in some rows."""
    phase = (2 * np.pi * s * relief.height_m[part]).astype(np.float32)
    return np.cos(phase), np.sin(phase)
