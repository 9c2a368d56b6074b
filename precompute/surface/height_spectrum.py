# SPDX-License-Identifier: GPL-3.0-or-later
"""The power spectrum of heights, and the position of its peaks between the bins."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .height_map import HeightMap
from .holes import fill_missing

# Bins in the group of the longest waves, several times the bins of the window's main lobe.
_FEWEST_COMPARED = 96


@dataclass(frozen=True)
class Spectrum:
    """The power spectrum of windowed heights.

    power   (ny, nx) in square metres; a sine of amplitude a has a peak of about a^2. ny: vertical frequencies in the
            order of np.fft.fftfreq; nx: horizontal frequencies from 0 up; both in cycles per scan
    size_m  (Ly, Lx), the sides of the scan in metres
    cols    number of columns of the heights"""

    power: np.ndarray
    size_m: tuple[float, float]
    cols: int

    @property
    def ky(self) -> np.ndarray:
        """Vertical frequencies (ny, 1), whole cycles per scan."""
        return np.round(np.fft.fftfreq(len(self.power)) * len(self.power))[:, None]

    @property
    def kx(self) -> np.ndarray:
        """Horizontal frequencies (nx,), whole cycles per scan."""
        return np.arange(self.power.shape[1])

    @property
    def q(self) -> np.ndarray:
        """Frequency of each bin (ny, nx), cycles per metre."""
        return np.hypot(self.ky / self.size_m[0], self.kx / self.size_m[1])

    def at(self, ky: int, kx: int) -> float:
        """Return the power at whole frequencies in cycles per scan; the array holds half of the even spectrum."""
        kx = (kx + self.cols // 2) % self.cols - self.cols // 2
        ky, kx = (ky, kx) if kx >= 0 else (-ky, -kx)
        return float(self.power[ky % len(self.power), kx])


def spectrum_of(level: HeightMap) -> Spectrum:
    """Compute the spectrum under a Hann window, without which the scan's edges add a cross of false peaks."""
    window_y, window_x = (np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2 for n in level.height_m.shape)
    windowed = fill_missing(level).height_m * window_y[:, None] * window_x
    transform = np.fft.rfft2(windowed)
    amplitude = np.abs(transform) * (2 / (window_y.sum() * window_x.sum()))
    return Spectrum(np.ascontiguousarray(amplitude**2), level.size_m, level.cols)


def amplitude_at(height: np.ndarray, cycles: tuple[float, float]) -> complex:
    """Return the Fourier transform of hole-free heights (rows, cols) under a Hann window at (ky, kx) cycles per scan.
    The phase is that at the scan's middle; the magnitude is not normalised."""
    along_y, along_x = (_transformed(*each) for each in zip(height.shape, cycles, strict=True))
    # A product with complex numbers would copy the heights as complex numbers.
    real, imaginary = (height @ np.stack([along_x.real, along_x.imag], axis=1)).T
    return complex(along_y @ real + 1j * (along_y @ imaginary))


def _transformed(count: int, cycles: float) -> np.ndarray:
    """Return a Hann window (count,) times the conjugate of a wave of `cycles` periods."""
    place = (np.arange(count) + 0.5) / count
    return np.sin(np.pi * place) ** 2 * np.exp(-2j * np.pi * cycles * (place - 0.5))


def ground_of(power: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the median power (ny, nx) of the bins of similar frequency, where q (ny, nx) is each bin's frequency."""
    power = power.ravel()
    ground = np.zeros(power.size)
    by_length = np.argsort(q, axis=None)
    start, stop = 0, _FEWEST_COMPARED
    while start < power.size:
        # Each group is as large as all coarser groups together: in two dimensions half an octave wide.
        group = by_length[start:stop]
        ground[group] = np.median(power[group])
        start, stop = stop, 2 * stop
    return ground.reshape(q.shape)


def refined(spectrum: Spectrum, peak: tuple[int, int]) -> tuple[float, float]:
    """Interpolate a peak's frequencies (ky, kx) between the bins, assuming a single wave."""
    ky, kx = peak
    centre = spectrum.at(ky, kx)
    return (
        ky + _between(spectrum.at(ky - 1, kx), centre, spectrum.at(ky + 1, kx)),
        kx + _between(spectrum.at(ky, kx - 1), centre, spectrum.at(ky, kx + 1)),
    )


def _between(below: float, centre: float, above: float) -> float:
    """Return a wave's offset in bins, -0.5 to 0.5, from the peak's bin, by the powers of the bin and its neighbours.

    Under a Hann window a wave d bins away has the amplitude sin(pi d) / (pi d (1 - d^2)). So the amplitudes a, b, c of
    three bins give d = 2 (c - a) / (a + 2 b + c) (Grandke 1983, by three points)."""
    a, b, c = (math.sqrt(power) for power in (below, centre, above))
    return min(0.5, max(-0.5, 2 * (c - a) / (a + 2 * b + c))) if b else 0.0
