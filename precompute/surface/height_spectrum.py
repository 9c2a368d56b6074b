# SPDX-License-Identifier: GPL-3.0-or-later
"""The power spectrum of heights, and where a peak of it lies between its bins."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .height_map import HeightMap
from .holes import fill_missing

# The longest waves are compared with this many of each other, several times as many as the window's lobe covers.
_FEWEST_COMPARED = 96


@dataclass(frozen=True)
class Spectrum:
    """The power spectrum of windowed heights.

    power   (ny, nx) in square metres; a sine of amplitude a has a peak of about a^2. Rows are the vertical frequencies
            in the order of np.fft.fftfreq, columns the horizontal frequencies from 0 up, both in cycles per scan
    size_m  (Ly, Lx), the sides of the scan in metres
    cols    number of columns of the heights
    """

    power: np.ndarray
    size_m: tuple[float, float]
    cols: int

    @property
    def ky(self) -> np.ndarray:
        """Vertical frequency of each row (ny, 1), whole cycles per scan."""
        return np.round(np.fft.fftfreq(len(self.power)) * len(self.power))[:, None]

    @property
    def kx(self) -> np.ndarray:
        """Horizontal frequency of each column (nx,), whole cycles per scan."""
        return np.arange(self.power.shape[1])

    @property
    def q(self) -> np.ndarray:
        """Frequency of each bin (ny, nx), cycles per metre."""
        return np.hypot(self.ky / self.size_m[0], self.kx / self.size_m[1])

    def at(self, ky: int, kx: int) -> float:
        """The power at any pair of whole frequencies, in cycles per scan.

        The array holds half of the frequencies. The others follow because the spectrum of real heights is even and
        periodic."""
        kx = (kx + self.cols // 2) % self.cols - self.cols // 2
        ky, kx = (ky, kx) if kx >= 0 else (-ky, -kx)
        return float(self.power[ky % len(self.power), kx])


def spectrum_of(level: HeightMap) -> Spectrum:
    """The spectrum of the heights under a Hann window; without a window the scan's edges would add a cross of false
    peaks."""
    window_y, window_x = (np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2 for n in level.height_m.shape)
    windowed = fill_missing(level).height_m * window_y[:, None] * window_x
    transform = np.fft.rfft2(windowed)
    amplitude = np.abs(transform) * (2 / (window_y.sum() * window_x.sum()))
    return Spectrum(np.ascontiguousarray(amplitude**2), level.size_m, level.cols)


def amplitude_at(height: np.ndarray, cycles: tuple[float, float]) -> complex:
    """The transform of heights (rows, cols) without holes under a Hann window, at a wave of (ky, kx) cycles per scan.

    Its phase is the wave's in the middle of the scan; its size is not normalised."""
    along_y, along_x = (_transformed(*each) for each in zip(height.shape, cycles, strict=True))
    # Real heights times complex numbers would be copied as complex numbers.
    real, imaginary = (height @ np.stack([along_x.real, along_x.imag], axis=1)).T
    return complex(along_y @ real + 1j * (along_y @ imaginary))


def _transformed(count: int, cycles: float) -> np.ndarray:
    """A Hann window (count,) times the conjugate of a wave of so many cycles in it."""
    place = (np.arange(count) + 0.5) / count
    return np.sin(np.pi * place) ** 2 * np.exp(-2j * np.pi * cycles * (place - 0.5))


def ground_of(power: np.ndarray, q: np.ndarray) -> np.ndarray:
    """For each bin (ny, nx) the median power of all waves of about its own length.

    q (ny, nx) is the frequency of each bin."""
    power = power.ravel()
    ground = np.zeros(power.size)
    by_length = np.argsort(q, axis=None)
    start, stop = 0, _FEWEST_COMPARED
    while start < power.size:
        # Each group has as many waves as all coarser ones together: in two dimensions it is half an octave wide.
        group = by_length[start:stop]
        ground[group] = np.median(power[group])
        start, stop = stop, 2 * stop
    return ground.reshape(q.shape)


def refined(spectrum: Spectrum, peak: tuple[int, int]) -> tuple[float, float]:
    """The frequencies (ky, kx) of a peak between the bins, as if it were one wave's."""
    ky, kx = peak
    centre = spectrum.at(ky, kx)
    return (
        ky + _between(spectrum.at(ky - 1, kx), centre, spectrum.at(ky + 1, kx)),
        kx + _between(spectrum.at(ky, kx - 1), centre, spectrum.at(ky, kx + 1)),
    )


def _between(below: float, centre: float, above: float) -> float:
    """Offset in bins, from -0.5 to 0.5, of a wave's frequency from the bin of the peak, from the powers of that bin and
    of its neighbours.

    A wave d bins away has the amplitude sin(pi d) / (pi d (1 - d^2)) under a Hann window, so that of the amplitudes
    a, b, c of three bins 2 (c - a) / (a + 2 b + c) is d (Grandke 1983, by three points)."""
    a, b, c = (math.sqrt(power) for power in (below, centre, above))
    return min(0.5, max(-0.5, 2 * (c - a) / (a + 2 * b + c))) if b else 0.0
