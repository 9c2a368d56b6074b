# SPDX-License-Identifier: GPL-3.0-or-later
"""A height map made ready for the Fourier transform: levelled, filled, fine enough, apodised."""

from dataclasses import dataclass

import numpy as np

from ..colour.observer import WAVELENGTH_MIN_M
from .height_map import HeightMap
from .holes import fill_missing
from .levelling import level_plane

# |u| reaches 2 at grazing light and view, so q reaches 2 / lambda_min: pixels over lambda_min / 4 alias.
PIXEL_MAX_M = WAVELENGTH_MIN_M / 4


_APODISED_FRACTION = 0.125


@dataclass(frozen=True)
class Relief:
    """Heights (rows, cols) in metres with row index along +B and column index along +T, zero mean under the
    apodisation's square; the apodisation g as its two factors (rows,), (cols,); pixel_size_m (dy, dx)."""

    height_m: np.ndarray
    apodisation_axes: tuple[np.ndarray, np.ndarray]
    pixel_size_m: tuple[float, float]
    periodic: bool

    @property
    def apodisation(self) -> np.ndarray:
        """g (rows, cols)."""
        return np.outer(*self.apodisation_axes)

    @property
    def size_m(self) -> tuple[float, float]:
        rows, cols = self.height_m.shape
        return rows * self.pixel_size_m[0], cols * self.pixel_size_m[1]

    @property
    def height_range_m(self) -> float:
        return float(np.ptp(self.height_m))


def prepare(height_map: HeightMap) -> Relief:
    """Relief of a height map: plane removed (a synthetic surface whose edges wrap has none), holes filled, pixels
    refined until nothing aliases, edges apodised unless they wrap."""
    levelled = height_map if height_map.periodic else level_plane(height_map)
    height = fill_missing(levelled).height_m[::-1]
    pixel_size = height_map.pixel_size_m
    for axis in (0, 1):
        factor = int(np.ceil(pixel_size[axis] / PIXEL_MAX_M - 1e-9))
        if factor > 1 and height.shape[axis] > 1:
            height = _upsample(height, factor, axis, height_map.periodic)
    size_m = tuple(n * d for n, d in zip(height_map.height_m.shape, pixel_size, strict=True))
    pixel_size = tuple(length / n for length, n in zip(size_m, height.shape, strict=True))
    apodisation_axes = tuple(np.ones(n) if height_map.periodic else _tukey_window(n) for n in height.shape)
    weights = [apodisation**2 / np.sum(apodisation**2) for apodisation in apodisation_axes]
    height = height - weights[0] @ height @ weights[1]
    return Relief(height, apodisation_axes, pixel_size, height_map.periodic)


def _tukey_window(count: int) -> np.ndarray:
    """Tukey window: a cosine rise over an eighth of the scan at each end. A raw edge would add a false cross to the
    spectrum, several times the signal; a single row or column has no edges to apodisation."""
    if count == 1:
        return np.ones(1)
    x = (np.arange(count) + 0.5) / count
    edge = np.minimum(np.minimum(x, 1 - x) / _APODISED_FRACTION, 1)
    return 0.5 - 0.5 * np.cos(np.pi * edge)


def _upsample(height: np.ndarray, factor: int, axis: int, periodic: bool) -> np.ndarray:
    """Band-limited interpolation by zero padding the spectrum; a scan that does not wrap is mirrored first, so that
    its edges meet."""
    h = np.moveaxis(height, axis, -1)
    count = h.shape[-1]
    if not periodic:
        h = np.concatenate([h, h[..., ::-1]], axis=-1)
    n = h.shape[-1]
    spectrum = np.fft.rfft(h, axis=-1)
    if n % 2 == 0:
        spectrum[..., -1] *= 0.5
    # The new samples are cell centred as the old ones: a shift by half the difference of the two pixels.
    shift = 0.5 / factor - 0.5
    spectrum = spectrum * np.exp(2j * np.pi * np.arange(spectrum.shape[-1]) * shift / n)
    fine = np.fft.irfft(spectrum, n * factor, axis=-1) * factor
    return np.moveaxis(fine[..., : count * factor], -1, axis)
