# SPDX-License-Identifier: GPL-3.0-or-later
"""The phasor of a relief and its power spectrum (DESIGN 2).

p(x, y; s) = exp(-i 2 pi s h) with s = w / lambda. Its weighted mean is the zero order; what is left, transformed and
squared, is the scattered spectrum. By Parseval the two sum to 1 exactly, because the mean is taken under the square of
the apodisation, which makes it orthogonal to the rest.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..surface.relief import Relief

# Zero padding of a scan that does not wrap, in units of 1 / sigma_q (see frequency_grid).
_GUARD = 0.4


@dataclass(frozen=True)
class FrequencyGrid:
    """Which bins of the transform are kept: ascending q_y (ny,) and q_x (nx,) in cycles per metre, and the transform's
    shape: the relief's own if it wraps, else zero padded."""

    q_y: np.ndarray
    q_x: np.ndarray
    transform_shape: tuple[int, int]

    def part(self, kept: tuple[slice, slice]) -> "FrequencyGrid":
        """The grid of some rows and columns."""
        return FrequencyGrid(self.q_y[kept[0]], self.q_x[kept[1]], self.transform_shape)


def phasor(height_m: np.ndarray, s: float) -> np.ndarray:
    """exp(-i 2 pi s h), complex128, s in cycles per metre."""
    return np.exp((-2j * np.pi * s) * height_m)


def zero_order_amplitude(relief: Relief, s: float) -> complex:
    """Mean of the phasor under the apodisation's square; its squared modulus is the zero order's efficiency."""
    weights = relief.apodisation**2
    return complex(np.sum(weights * phasor(relief.height_m, s)) / np.sum(weights))


def frequency_grid(relief: Relief, q_max: float, finest_kernel: float) -> FrequencyGrid:
    """The bins with |q_x|, |q_y| <= q_max, for kernels of standard deviation finest_kernel (per metre) and wider.

    Blurring the bins of a transform weighs the scan's autocorrelation by a Gaussian of 1 / (2 pi finest_kernel), and
    where the scan does not wrap its two ends would meet there. Zero padding keeps them apart: by 0.4 / finest_kernel
    what still meets is weighed by exp(-2 pi^2 0.4^2) = 4e-2 at the padding's edge and less beyond, and holds next to no
    area under the apodisation; measured, 3e-4 of the peak. A surface that wraps has orders, not samples of a continuum,
    and a single row or column is a profile that does not change across it: neither is padded."""
    shape = []
    for count, pixel in zip(relief.height_m.shape, relief.pixel_size_m, strict=True):
        alone = relief.periodic or count == 1
        shape.append(count if alone else _smooth_length(count + math.ceil(_GUARD / (finest_kernel * pixel))))
    q_y, q_x = (_kept_frequencies(n, d, q_max) for n, d in zip(shape, relief.pixel_size_m, strict=True))
    return FrequencyGrid(q_y, q_x, tuple(shape))


def _smooth_length(least: int) -> int:
    """The smallest length from `least` with no prime factor over 7: a fast one for the transform."""
    length = least
    while True:
        rest = length
        for prime in (2, 3, 5, 7):
            while rest % prime == 0:
                rest //= prime
        if rest == 1:
            return length
        length += 1


def _kept_frequencies(count: int, pixel_m: float, q_max: float) -> np.ndarray:
    q = np.fft.fftshift(np.fft.fftfreq(count, pixel_m))
    return q[np.abs(q) <= q_max]


def scattered_spectrum(relief: Relief, s: float, grid: FrequencyGrid) -> tuple[np.ndarray, float]:
    """Power per bin (ny, nx) scattered out of the zero order, and the zero order's efficiency.

    Over all bins (not only those the grid keeps) the two sum to 1."""
    amplitude = zero_order_amplitude(relief, s)
    scattered = relief.apodisation * (phasor(relief.height_m, s) - amplitude)
    rows, cols = grid.transform_shape
    # Row by row first, so that the second pass runs over the kept columns alone.
    half = np.fft.fft(scattered, n=cols, axis=1)[:, fft_order(grid.q_x, cols)]
    kept = np.fft.fft(half, n=rows, axis=0)[fft_order(grid.q_y, rows)]
    norm = rows * cols * np.sum(relief.apodisation**2)
    return (kept.real**2 + kept.imag**2) / norm, abs(amplitude) ** 2


def fft_order(q: np.ndarray, count: int) -> np.ndarray:
    """Index into the unshifted transform of the contiguous kept frequencies around zero."""
    below_zero = int(np.sum(q < 0))
    return (np.arange(len(q)) - below_zero) % count
