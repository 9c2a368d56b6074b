# SPDX-License-Identifier: GPL-3.0-or-later
"""The patch model's power spectrum at every s.

sigma_s is the standard deviation of the window in metres, sigma_f = 1 / (2 pi sigma_s) that of its transform in cycles
per metre (docs/theory.md, section "Coherence").
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.progress import Progress, silent
from ..colour.observer import WAVELENGTH_MIN_M
from ..maths import chebyshev
from ..optics import coherence
from ..spectra.patch_window import PatchWindow
from ..spectra.resample import KERNEL_REACH
from ..spectra.series import SpectrumSeries, bound
from ..spectra.spectrum import FrequencyGrid, fft_order, phasor

# The reach of the window from its centre, and of the transform of |P|^2 from lag 0, both in units of sigma_s. There the
# window has fallen to 3e-4, and its autocorrelation, exp(-x^2 / (4 sigma_s^2)) at the lag x, to 1e-7 of its peak.
_WINDOW_REACH, _LAG_REACH = 4.0, 8.0
# From this lag, in units of sigma_s, to _LAG_REACH, the transform of |P|^2 is faded to 0. It is at most 1e-4 of its
# peak there. The fade keeps its quotient by the Gaussian's transform small.
_LAG_KEPT = 6.0
# The Gaussian's standard deviation, in units of sigma_f. The transform of |P|^2 repeats after 2 _LAG_REACH, and the
# Gaussian's transform suppresses the repetitions. The repetition of lag -5, where the autocorrelation is 2e-3 of its
# peak, is at lag 11. Its weight is exp(-48 0.45^2) = 6e-5: reading a table leaves about 0.45 of the 0.5. Shorter lags
# weigh less.
_GAUSSIAN = 0.5
# Cubic reading widens the Gaussian, so the Gaussian is narrowed. This share of its variance always stays, however
# coarse the table. It leaves a standard deviation of 0.3 sigma_f, and a weight of 1e-2 at lag 11.
_GAUSSIAN_LEFT = 0.36
# Number of points of the frequency grid beyond the requested region: near the rim of the grid the quotient is wrong.
_MARGIN = 40
# Share of the power that the series in s may omit.
_SERIES_TOLERANCE = 1e-4
# Rows or columns that are transformed at once, to save memory.
_ROWS_AT_ONCE = 64


@dataclass(frozen=True, kw_only=True)
class PatchSeries(SpectrumSeries):
    """The patch model's power per bin, at Chebyshev nodes in s.

    `scattered_over_s2` holds all of the power, not divided by s^2, because it does not vanish with s. `amplitude` is 0.
    The light of a bin is a Gaussian of standard deviation `gaussian` in q. `sigma_b` is the standard deviation of the
    window's own kernel in (u, v) at the reference wavelength. A requested kernel is narrower than sigma_b: kernel_left
    subtracts the difference of the variances from each bin's Gaussian. The patch is under `window`."""

    window: PatchWindow
    gaussian: float
    sigma_b: float

    def weights(self, s: np.ndarray) -> np.ndarray:
        """Like SpectrumSeries.weights, divided by s^2, because scattered_over_s2 holds the power itself here."""
        return super().weights(s) / np.asarray(s)[..., None] ** 2

    def zero_order(self, s: np.ndarray) -> np.ndarray:
        """Zero: the zero order is not separated from the other light."""
        return np.zeros(np.shape(s))

    def kernel_left(self, sigma: float, wavelength_m: float) -> tuple[float, float]:
        """The standard deviation, twice, of the bins' Gaussian in (u, v) at a wavelength, for a kernel sigma up to
        sigma_b.

        The Gaussian's variance is smaller by sigma_b^2 - sigma^2, but at least the share _GAUSSIAN_LEFT."""
        whole = (wavelength_m * self.gaussian) ** 2
        left = math.sqrt(max(whole + sigma**2 - self.sigma_b**2, _GAUSSIAN_LEFT * whole))
        return left, left


def patch_series(window: PatchWindow, reach: float, progress: Progress = silent) -> PatchSeries:
    """Compute the series of a window's relief for |u|, |v| <= reach. `progress` is called after each transform."""
    s_max = 2 / WAVELENGTH_MIN_M
    gaussian = _GAUSSIAN * window.sigma_f
    q_max = reach / WAVELENGTH_MIN_M + KERNEL_REACH * gaussian
    axes = [_Axis(window, axis, q_max) for axis in (0, 1)]
    count = bound(window.relief, s_max, _SERIES_TOLERANCE)
    power = np.empty((count, *(len(axis.q) for axis in axes)), np.float32)
    for k, s in enumerate(chebyshev.nodes(count, 0, s_max)):
        power[k] = _power(window, axes, s)
        progress("transforms", (k + 1) / count)
    grid = FrequencyGrid(axes[0].q, axes[1].q, (axes[0].transform, axes[1].transform))
    sigma_b = coherence.kernel_sigma(4 * window.sigma_m)
    return PatchSeries(grid, s_max, power, np.zeros(count), window=window, gaussian=gaussian, sigma_b=sigma_b)


class _Axis:
    """The pixels under the window, the window, and the kept frequencies, along axis 0 (B) or 1 (T)."""

    def __init__(self, window: PatchWindow, axis: int, q_max: float):
        pixel, count = window.relief.pixel_size_m[axis], window.relief.height_m.shape[axis]
        half = math.ceil(_WINDOW_REACH * window.sigma_m / pixel)
        offset = np.arange(-half, half + 1)
        self.pixels = (offset + count // 2) % count
        self.window = (
            np.exp(-0.5 * (offset * pixel / window.sigma_m) ** 2) * window.relief.apodisation_axes[axis][self.pixels]
        )
        self.transform = math.ceil(2 * _LAG_REACH * window.sigma_m / pixel)
        self.spacing = 1 / (self.transform * pixel)
        last = min(math.ceil(q_max / self.spacing) + _MARGIN, (self.transform - 1) // 2)
        self.q = np.arange(-last, last + 1) * self.spacing
        lag = np.abs(np.fft.fftfreq(len(self.q), self.spacing)) / window.sigma_m
        fall = np.clip((lag - _LAG_KEPT) / (_LAG_REACH - _LAG_KEPT), 0, 1)
        self.undo = np.exp(0.5 * (_GAUSSIAN * np.minimum(lag, _LAG_REACH)) ** 2) * (0.5 + 0.5 * np.cos(np.pi * fall))


def _power(window: PatchWindow, axes: Sequence[_Axis], s: float) -> np.ndarray:
    """PSD per bin (ny, nx) at s, after its transform was divided by the Gaussian's."""
    y, x = axes
    field = phasor(window.relief.height_m, s).astype(np.complex64)
    half = np.empty((len(y.pixels), len(x.q)), np.complex64)
    for start in range(0, len(y.pixels), _ROWS_AT_ONCE):
        part = slice(start, start + _ROWS_AT_ONCE)
        rows = field[np.ix_(y.pixels[part], x.pixels)] * (y.window[part, None] * x.window).astype(np.float32)
        half[part] = np.fft.fft(rows, x.transform, axis=1)[:, fft_order(x.q, x.transform)]
    power = np.empty((len(y.q), len(x.q)), np.float32)
    for start in range(0, len(x.q), _ROWS_AT_ONCE):
        part = slice(start, start + _ROWS_AT_ONCE)
        kept = np.fft.fft(half[:, part], y.transform, axis=0)[fft_order(y.q, y.transform)]
        power[:, part] = kept.real**2 + kept.imag**2
    transform = np.fft.rfft2(power)
    transform *= y.undo[:, None] * x.undo[: transform.shape[1]]
    return np.fft.irfft2(transform, power.shape) * (window.density_scale() * y.spacing * x.spacing)
