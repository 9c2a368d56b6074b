# SPDX-License-Identifier: GPL-3.0-or-later
"""The scattered spectrum at every s, interpolated between a few values of s (Jacobi-Anger).

|P|^2 is a sum of exp(-i 2 pi s (h - h')), so it is band limited in s by the relief's range, and its values at a few
Chebyshev nodes give it everywhere. The scattered part vanishes as s^2: that factor is taken out, so that the quotient
stays well conditioned down to grazing directions, where s -> 0.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..base.progress import Progress, silent
from ..maths import chebyshev
from ..surface.relief import Relief
from .spectrum import FrequencyGrid, scattered_spectrum, zero_order_amplitude

COUNT_MIN = 4


@dataclass(frozen=True)
class SpectrumSeries:
    """The scattered spectrum over s^2, and the zero order's amplitude, at Chebyshev nodes in s on [0, s_max].

    `blur_q` is the standard deviation, in cycles per metre, of a Gaussian that the bins have been blurred by;
    `periodic` whether they are orders of a surface that wraps, not samples of a continuum."""

    grid: FrequencyGrid
    s_max: float
    scattered_over_s2: np.ndarray  # (count, ny, nx), square metres
    amplitude: np.ndarray  # (count,) complex
    blur_q: float = 0.0
    periodic: bool = True

    def weights(self, s: np.ndarray) -> np.ndarray:
        """Interpolation weights (..., count) of the nodes at s (...,)."""
        return chebyshev.interpolation_matrix(s, len(self.amplitude), 0, self.s_max)

    def zero_order(self, s: np.ndarray) -> np.ndarray:
        """Efficiency of the zero order at s (...,)."""
        return np.abs(self.weights(s) @ self.amplitude) ** 2

    def mixed(self, weights: np.ndarray, kept: tuple[slice, slice]) -> np.ndarray:
        """Sums (ny, k, nx) over the nodes with weights (k, count), of the kept bins (rows, columns)."""
        rows, columns = kept
        weights = weights.astype(self.scattered_over_s2.dtype)
        return weights @ self.scattered_over_s2.transpose(1, 0, 2)[rows, :, columns]

    def kernel_left(self, sigma: float, wavelength_m: float) -> float:
        """What of a kernel sigma in (u, v) the bins have not been blurred by yet."""
        return math.sqrt(sigma**2 - (wavelength_m * self.blur_q) ** 2)


def spectrum_series(
    relief: Relief, grid: FrequencyGrid, s_max: float, tolerance: float, *, progress: Progress = silent
) -> SpectrumSeries:
    """The series in float64, whose interpolation error is at most `tolerance` of its largest value.

    `progress` hears of each transform."""
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
    """Nodes in s that are enough whatever the relief's shape between its highest and deepest point."""
    # The exponent spans 2 pi s * range over s in [0, s_max]: half of that on either side of the middle.
    return max(COUNT_MIN, chebyshev.jacobi_anger_terms(np.pi * s_max * relief.height_range_m, tolerance))
