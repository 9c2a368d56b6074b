# SPDX-License-Identifier: GPL-3.0-or-later
"""The relief: a height map prepared for the Fourier transform (levelled, holes filled, upsampled, apodised)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.machine import refuse_beyond_memory
from ..colour.observer import WAVELENGTH_MIN_M
from ..optics.plate import NO_PLATE
from .height_map import HeightMap, fill_missing
from .steps.pipeline import DEFAULT, level
from .steps.step import Step

# With grazing light and view, |u| reaches 2 and |q| reaches 2 / lambda_min. Larger pixels would alias.
PIXEL_MAX_M = WAVELENGTH_MIN_M / 4
# The remedy for a relief with too many pixels.
SMALLER = "crop the scan, or give its true size if that is smaller"
# Peak memory of `prepare` per pixel of the upsampled relief, as measured.
_BYTES_PER_PIXEL = 28
# The share of the scan's side over which the apodisation window rises at each end. The power spectrum of a shorter rise
# has stronger side lobes. Then no narrower kernel gives an order both the peak and the width of the stated kernel.
_APODISED_FRACTION = 0.2


@dataclass(frozen=True)
class Relief:
    """Heights ready for the Fourier transform.

    height_m          (rows, cols) in metres; the row index runs along +B (in a HeightMap along -B), the column index
                      along +T. Its mean, weighted by the squared apodisation, is zero
    apodisation_axes  factors (rows,) and (cols,) of the apodisation window g
    pixel_size_m      (dy, dx) in metres
    periodic          whether the edges wrap exactly"""

    height_m: np.ndarray
    apodisation_axes: tuple[np.ndarray, np.ndarray]
    pixel_size_m: tuple[float, float]
    periodic: bool

    @property
    def apodisation(self) -> np.ndarray:
        """The apodisation window g (rows, cols), from 0 to 1."""
        return np.outer(*self.apodisation_axes)

    @property
    def size_m(self) -> tuple[float, float]:
        """(Ly, Lx): the sides in metres, from outer edge to outer edge."""
        rows, cols = self.height_m.shape
        return rows * self.pixel_size_m[0], cols * self.pixel_size_m[1]

    @property
    def height_range_m(self) -> float:
        """Highest minus lowest height in metres."""
        return float(np.ptp(self.height_m))

    @property
    def window_q(self) -> tuple[float, float]:
        """Widths (y, x) of the apodisation window's power spectrum, in cycles per metre; 0 along an axis without one.

        A width is the standard deviation of the Gaussian of the same peak and energy: the equivalent noise bandwidth
        (Harris 1978) over sqrt(2 pi)."""
        widths = (
            float(np.sum(g**2) / np.sum(g) ** 2) / (math.sqrt(2 * math.pi) * pixel) if g.min() < 1 else 0.0
            for g, pixel in zip(self.apodisation_axes, self.pixel_size_m, strict=True)
        )
        along_y, along_x = widths
        return along_y, along_x

    def scaled(self, factor: float) -> "Relief":
        """The relief, `factor` times as large in every dimension."""
        dy, dx = self.pixel_size_m
        return replace(self, height_m=self.height_m * factor, pixel_size_m=(dy * factor, dx * factor))


def prepare(height_map: HeightMap, steps: Sequence[Step] = DEFAULT, *, plate_ior: float = NO_PLATE) -> Relief:
    """Level a height map by steps, by default a plane, and make a relief of it.

    Raises GratingError as `level` and `relief_of` do.

    >>> relief = prepare(read_height_map("sample:blazed"))
    >>> relief.height_m.shape, f"{relief.pixel_size_m[0] * 1e9:.1f} nm"
    ((832, 832), '78.1 nm')"""
    return relief_of(level(height_map, steps).height_map, plate_ior=plate_ior)


def relief_of(levelled: HeightMap, *, plate_ior: float = NO_PLATE) -> Relief:
    """Make a relief of levelled heights: fill holes, upsample to pixels of at most PIXEL_MAX_M, apodise the edges.

    Under a plate the pixels are finer, because the wavelength is shorter there.
    Periodic surfaces keep their edges. Raises GratingError if the relief would take over half of the free memory."""
    pixel_max_m = PIXEL_MAX_M / plate_ior
    factors = [
        _refinement(count, pixel_m / pixel_max_m)
        for count, pixel_m in zip(levelled.height_m.shape, levelled.pixel_size_m, strict=True)
    ]
    rows, cols = (n * factor for n, factor in zip(levelled.height_m.shape, factors, strict=True))
    refuse_beyond_memory(
        _BYTES_PER_PIXEL * rows * cols,
        f"its relief, refined to {rows} x {cols} pixels of at most {pixel_max_m * 1e9:.0f} nm,",
        SMALLER,
        source=levelled.source,
    )
    height = fill_missing(levelled).height_m[::-1]
    pixel_size = levelled.pixel_size_m
    for axis, factor in enumerate(factors):
        if factor > 1:
            height = _upsample(height, factor, axis, periodic=levelled.periodic)
    size_m = tuple(n * d for n, d in zip(levelled.height_m.shape, pixel_size, strict=True))
    dy, dx = (length / n for length, n in zip(size_m, height.shape, strict=True))
    along_y, along_x = (np.ones(n) if levelled.periodic else _tukey_window(n) for n in height.shape)
    weights = [apodisation**2 / np.sum(apodisation**2) for apodisation in (along_y, along_x)]
    height = height - weights[0] @ height @ weights[1]
    return Relief(height, (along_y, along_x), (dy, dx), levelled.periodic)


def _refinement(count: int, size: float) -> int:
    """Return the upsampling factor along an axis, whose pixels have `size` times the largest size; 1 for a single row
    or column."""
    return max(1, int(np.ceil(size - 1e-9))) if count > 1 else 1


def _tukey_window(count: int) -> np.ndarray:
    """Return the Tukey window (count,): a cosine rise over a fifth of the scan at each end, 1 between.

    Without a window, the edges add a cross to the spectrum, several times stronger than the signal. A single row or
    column has the window 1."""
    if count == 1:
        return np.ones(1)
    x = (np.arange(count) + 0.5) / count
    edge = np.minimum(np.minimum(x, 1 - x) / _APODISED_FRACTION, 1)
    return 0.5 - 0.5 * np.cos(np.pi * edge)


def _upsample(height: np.ndarray, factor: int, axis: int, *, periodic: bool) -> np.ndarray:
    """Upsample heights `factor` times along an axis by zero padding the spectrum.

    Exact for band-limited heights that wrap. Other heights are first joined to their mirror image, which wraps."""
    h = np.moveaxis(height, axis, -1)
    count = h.shape[-1]
    if not periodic:
        h = np.concatenate([h, h[..., ::-1]], axis=-1)
    n = h.shape[-1]
    spectrum = np.fft.rfft(h, axis=-1)
    if n % 2 == 0:
        spectrum[..., -1] *= 0.5
    # Samples lie at pixel centres, so the first old and new sample are half the difference of the pixel sizes apart.
    shift = 0.5 / factor - 0.5
    spectrum = spectrum * np.exp(2j * np.pi * np.arange(spectrum.shape[-1]) * shift / n)
    fine = np.fft.irfft(spectrum, n * factor, axis=-1) * factor
    return np.moveaxis(fine[..., : count * factor], -1, axis)
