# SPDX-License-Identifier: GPL-3.0-or-later
"""The series in s as a bake makes it: in single precision, from as few transforms as the relief needs.

The nodes that a bake needs are the whole price of its transforms. The bound, which counts on as much light between the
highest and the deepest point as anywhere, is about twice what a real scan takes: `fast_series` measures the number on
small cuts of the relief and confirms it on the whole.
"""

import math

import numpy as np

from ..base.progress import Progress, silent
from ..maths import chebyshev
from ..surface.relief import Relief
from .resample import KERNEL_REACH, Resampler
from .series import COUNT_MIN, SpectrumSeries, bound
from .spectrum import FrequencyGrid, fft_order, frequency_grid, scattered_spectrum

# Cuts of a relief on which the number of nodes is measured, in pixels a side; a relief not much larger is measured by
# the bound alone.
_CUT = 192


_ROWS_AT_ONCE, _COLUMNS_AT_ONCE = 128, 64


# A hundred times what single precision scatters.
ROUNDING = 1e-10


# Share of a kernel that may go into a blur of the bins themselves, and the bins' spacing after it, in units of the
# kernel at the longest wavelength: summed with the rest of the kernel, bins so far apart are flat to
# 2 exp(-2 pi^2 * 0.6^2 * 0.8^2 / 0.75^2) = 6e-4 of what an order of its own would show.
_BLUR, _SPACING = 0.6, 0.75


def exact_error(relief: Relief, series: SpectrumSeries, s_values: np.ndarray) -> float:
    """The largest share of the scattered light by which the series is off at s_values: in float64, unless the bins are
    so many that they were thinned out. What a mirror scatters by rounding alone is no light."""
    worst = 0.0
    for s in s_values:
        if series.blur_q:
            fine = frequency_grid(relief, series.grid.q_x[-1], series.blur_q / _BLUR)
            exact = _blurred(_power(relief, s, fine)[0], fine, series.grid, series.blur_q)
        else:
            exact, _ = scattered_spectrum(relief, s, series.grid)
        found = series.mixed(series.weights(np.array([s])) * s**2, (slice(None), slice(None)))[:, 0]
        total = exact.sum(dtype=float)
        if total > ROUNDING:
            worst = max(worst, float(np.abs(found - exact).sum(dtype=float) / total))
    return worst


def fast_series(
    relief: Relief, q_max: float, s_max: float, *, finest_kernel: float, tolerance: float, progress: Progress = silent
) -> SpectrumSeries:
    """The series in single precision, for kernels of finest_kernel (per metre) and wider, of bins up to q_max.

    What the series leaves out is about `tolerance` of the light, as its last coefficients tell. Bins finer than such a
    kernel can show are blurred by a part of it and thinned out. `progress` hears of each transform."""
    grid = frequency_grid(relief, q_max, finest_kernel)
    most = bound(relief, s_max, tolerance)
    count = min(most, measured_count(relief, q_max, s_max, tolerance))
    while True:
        series = _transforms(relief, grid, s_max, finest_kernel, count, progress)
        left_out, ratio = _left_out(_coefficient_sizes(series.scattered_over_s2))
        if count == most or left_out <= 2 * tolerance:
            return series
        count = min(most, count + math.ceil(2 * math.log(tolerance / left_out) / math.log(ratio)))


def measured_count(relief: Relief, q_max: float, s_max: float, tolerance: float) -> int:
    """Nodes in s that three cuts of the relief need: its middle, around its highest and around its deepest point."""
    most = bound(relief, s_max, tolerance)
    rows, cols = relief.height_m.shape
    if max(rows, cols) < 2 * _CUT:
        return most
    places = [(rows // 2, cols // 2)]
    places += [np.unravel_index(find(relief.height_m), (rows, cols)) for find in (np.argmax, np.argmin)]
    nodes = chebyshev.nodes(most, 0, s_max)
    counts = []
    for place in places:
        part = tuple(_slice_around(at, n) for at, n in zip(place, (rows, cols), strict=True))
        height = relief.height_m[part]
        apodisation_axes = tuple(np.hanning(n + 2)[1:-1] if n > 1 else np.ones(1) for n in height.shape)
        cut = Relief(height, apodisation_axes, relief.pixel_size_m, periodic=True)
        grid = frequency_grid(cut, q_max, 1.0)
        sizes = _coefficient_sizes(np.stack([_power(cut, s, grid)[0] / np.float32(s**2) for s in nodes]))
        counts.append(int(np.count_nonzero(np.cumsum(sizes[::-1])[::-1] > tolerance * sizes.sum())))
    return max(COUNT_MIN, *counts)


def _slice_around(at: int, count: int) -> slice:
    start = int(np.clip(at - _CUT // 2, 0, max(count - _CUT, 0)))
    return slice(start, start + min(_CUT, count))


def _coefficient_sizes(values: np.ndarray) -> np.ndarray:
    """Sum (count,) over the bins of the moduli of the Chebyshev coefficients of values (count, ...) at the nodes."""
    flat = values.reshape(len(values), -1)
    matrix = chebyshev.coefficients_from_nodes(len(values)).astype(values.dtype)
    blocks = range(0, flat.shape[1], 1 << 18)
    return sum(np.abs(matrix @ flat[:, start : start + (1 << 18)]).sum(axis=1, dtype=float) for start in blocks)


def _left_out(sizes: np.ndarray) -> tuple[float, float]:
    """Share of the light in the coefficients after the last, and the ratio by which two of them are smaller than the
    two before: they fall at least geometrically (Jacobi-Anger), even and odd ones by themselves."""
    before, last = sizes[-4:-2].sum(), sizes[-2:].sum()
    ratio = min(last / max(before, 1e-300), 0.5)
    return last * ratio / (1 - ratio) / max(sizes.sum(), 1e-300), max(ratio, 1e-6)


def _transforms(relief, grid, s_max, finest_kernel, count, progress: Progress) -> SpectrumSeries:
    coarse = _thinned_grid(grid, finest_kernel)
    blur_q = 0.0 if coarse is grid else _BLUR * finest_kernel
    scattered = np.empty((count, len(coarse.q_y), len(coarse.q_x)), np.float32)
    amplitude = np.empty(count, complex)
    for k, s in enumerate(chebyshev.nodes(count, 0, s_max)):
        power, amplitude[k] = _power(relief, s, grid)
        power /= np.float32(s**2)
        scattered[k] = power if coarse is grid else _blurred(power, grid, coarse, blur_q)
        progress("transforms", (k + 1) / count)
    return SpectrumSeries(coarse, s_max, scattered, amplitude, blur_q, relief.periodic)


def _thinned_grid(grid: FrequencyGrid, finest_kernel: float) -> FrequencyGrid:
    """The grid itself, unless half its bins or more are finer than a kernel can show."""
    spacing = _SPACING * finest_kernel
    reach = [math.ceil((q[-1] + KERNEL_REACH * _BLUR * finest_kernel) / spacing) for q in (grid.q_y, grid.q_x)]
    if np.prod([2 * n + 1 for n in reach]) > 0.5 * len(grid.q_y) * len(grid.q_x):
        return grid
    return FrequencyGrid(*(np.arange(-n, n + 1) * spacing for n in reach), grid.transform_shape)


def _blurred(power: np.ndarray, grid: FrequencyGrid, coarse: FrequencyGrid, blur_q: float) -> np.ndarray:
    """Power in bins of the coarse grid, each the Gaussian sum over those of the fine one."""
    resample = Resampler(grid, coarse.q_x, coarse.q_y, 1.0, blur_q)
    return resample(power[resample.kept]) * np.float32(
        (coarse.q_y[1] - coarse.q_y[0]) * (coarse.q_x[1] - coarse.q_x[0])
    )


def _power(relief: Relief, s: float, grid: FrequencyGrid) -> tuple[np.ndarray, complex]:
    """Power per bin (ny, nx) float32 scattered out of the zero order, and the zero order's amplitude.

    As scattered_spectrum, in single precision and a few rows or columns at a time. A phasor is right to 1e-6 of 1, so
    what rounding scatters, 1e-12 of the light, lies far under the share of the shallowest relief that shows."""
    amplitude = _mean_phasor(relief, s)
    rows, cols = grid.transform_shape
    kept_x, kept_y = fft_order(grid.q_x, cols), fft_order(grid.q_y, rows)
    half = np.empty((len(relief.height_m), len(kept_x)), np.complex64)
    apodisation_y, apodisation_x = (apodisation.astype(np.float32) for apodisation in relief.apodisation_axes)
    for part, cosine, sine in _phases(relief, s):
        field = np.empty(cosine.shape, np.complex64)
        field.real = cosine - np.float32(amplitude.real)
        field.imag = -sine - np.float32(amplitude.imag)
        field *= apodisation_y[part, None] * apodisation_x
        half[part] = np.fft.fft(field, cols, axis=1)[:, kept_x]
    power = np.empty((len(kept_y), len(kept_x)), np.float32)
    for start in range(0, len(kept_x), _COLUMNS_AT_ONCE):
        part = slice(start, start + _COLUMNS_AT_ONCE)
        kept = np.fft.fft(half[:, part], rows, axis=0)[kept_y]
        power[:, part] = kept.real**2 + kept.imag**2
    power /= np.float32(rows * cols * np.prod([np.sum(apodisation**2) for apodisation in relief.apodisation_axes]))
    return power, amplitude


def _mean_phasor(relief: Relief, s: float) -> complex:
    weights_y, weights_x = (apodisation**2 / np.sum(apodisation**2) for apodisation in relief.apodisation_axes)
    total = 0j
    for part, cosine, sine in _phases(relief, s):
        total += weights_y[part] @ (cosine @ weights_x - 1j * (sine @ weights_x))
    return complex(total)


def _phases(relief: Relief, s: float):
    """Rows at once, and cos and sin (n, cols) float32 of 2 pi s h in them."""
    for start in range(0, len(relief.height_m), _ROWS_AT_ONCE):
        part = slice(start, start + _ROWS_AT_ONCE)
        phase = (2 * np.pi * s * relief.height_m[part]).astype(np.float32)
        yield part, np.cos(phase), np.sin(phase)
