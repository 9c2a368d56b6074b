# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes a bake's series in s in single precision, with as few nodes as the relief needs.

Each node in s costs a transform. `bound` gives a number of nodes that is enough for every relief of the same height
range, about twice what a real scan needs. So `fast_series` measures the number on small cuts of the relief, then
confirms it on the whole relief.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..base.failure import GratingError
from ..base.progress import Progress, silent
from ..maths import chebyshev
from ..surface.relief import Relief
from .resample import KERNEL_REACH, Resampler
from .series import COUNT_MIN, SpectrumSeries, bound
from .spectrum import FrequencyGrid, frequency_grid, kept_bins, power_of_rows, row_blocks, scattered_spectrum
from .turns import over_turns

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
