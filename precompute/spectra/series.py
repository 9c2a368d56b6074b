# SPDX-License-Identifier: GPL-3.0-or-later
"""Interpolates the scattered spectrum at every s from a few values of s (docs/theory.md, Expansions).

Let P be the transform of the phasor at s, and h and h' the heights of two pixels. |P|^2 is a sum of terms exp(-i 2 pi s
(h - h')). So the range of the relief limits its band in s, and a few Chebyshev nodes suffice. The scattered part
vanishes as s^2. The series holds the spectrum divided by s^2, which stays well conditioned at grazing angles.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base.progress import Progress, silent
from ..maths import chebyshev
from ..surface.relief import Relief
from .spectrum import FrequencyGrid, scattered_spectrum, zero_order_amplitude
from .turns import over_turns

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
    turns              standard deviation, in radians, of the turns over which the bins are averaged (turns.py)
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
