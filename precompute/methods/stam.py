# SPDX-License-Identifier: GPL-3.0-or-later
"""Stam's own form for a regular grating (Stam 1999, section 6): one bump repeated at every period d along T.

The spectrum of a row of bumps is the spectrum of one bump at the frequencies n / d. So a direction u sees only the
wavelengths lambda_n = |u| d / n, each weighted by the observer and by the Jacobian |d lambda / d u| = d / n:

    XYZ = kernel(v) sum_n |P_n(w / lambda_n)|^2 d / |n| observer(lambda_n),
    P_n(s) = (1 / d) integral over a period of exp(-i 2 pi s h) exp(-i 2 pi n x / d)

The bump is the mean profile over the relief's periods, which is exact for a line grating. An irregular grating is
reduced to this mean. Along v Stam's orders have no width; here they are as wide as the ensemble's kernel.
Stam's obliquity is in optics/brdf.py.
"""

from dataclasses import dataclass

import numpy as np

from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, observer, spectral_weights, wavelengths
from ..optics import coherence
from ..surface.quality import grating_period
from ..surface.relief import Relief
from .method import Coherence, Method, MethodEntry, Settings

_SAMPLES_MAX = 256
_CHUNK = 4096


@dataclass(frozen=True)
class Stam(Method):
    """A profile (samples,) in metres over one period, and the kernel sigma_b that widens its orders."""

    profile_m: np.ndarray
    period_m: float
    sigma_b: float
    settings: Settings
    name: str = "stam"
    coherence: Coherence = "ensemble"

    def efficiency(self, order: int, s: np.ndarray) -> np.ndarray:
        """|P_n(s)|^2 (m,) of an order at s (m,) in cycles per metre."""
        count = len(self.profile_m)
        wave = np.exp((-2j * np.pi * order / count) * np.arange(count)) / count
        out = np.empty(len(s))
        for start in range(0, len(s), _CHUNK):
            part = slice(start, start + _CHUNK)
            out[part] = np.abs(np.exp((-2j * np.pi) * s[part, None] * self.profile_m) @ wave) ** 2
        return out

    def density(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float, *, wavelength_m: float) -> np.ndarray:
        """See Method: every order is as wide as the kernel."""
        u, v, w = np.broadcast_arrays(u, v, w)
        s = w / wavelength_m
        last = int(2 * self.period_m / wavelength_m) + 1
        out = np.zeros(len(u))
        for n in range(-last, last + 1):
            at = np.abs(u - n * wavelength_m / self.period_m) < 8 * self.sigma_b
            offset = u[at] - n * wavelength_m / self.period_m
            out[at] += self.efficiency(n, s[at]) * self._kernel(offset)
        return out * self._kernel(v)

    def xyz(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float) -> np.ndarray:
        """See Method: Stam's sum, in which the orders are lines in u."""
        u, v, w = np.broadcast_arrays(u, v, w)
        out = np.zeros((len(u), 3))
        for n in range(1, int(2 * self.period_m / WAVELENGTH_MIN_M) + 1):
            lam = np.abs(u) * self.period_m / n
            for sign in (1, -1):
                at = (np.sign(u) == sign) & (lam >= WAVELENGTH_MIN_M) & (lam <= WAVELENGTH_MAX_M)
                weight = self.efficiency(sign * n, w[at] / lam[at]) * self.period_m / n
                out[at] += weight[:, None] * observer(lam[at], self.settings.illuminant)
        at = np.abs(u) < 8 * self.sigma_b
        lambdas = wavelengths(self.settings.step_m)
        weights = spectral_weights(lambdas, self.settings.illuminant)
        for lam, weight in zip(lambdas, weights, strict=True):
            out[at] += (self.efficiency(0, w[at] / lam) * self._kernel(u[at]))[:, None] * weight
        return out * self._kernel(v)[:, None]

    @property
    def table_bytes(self) -> int:
        """Bytes of the profile."""
        return self.profile_m.nbytes

    def _kernel(self, x: np.ndarray) -> np.ndarray:
        return np.exp(-0.5 * (x / self.sigma_b) ** 2) / (np.sqrt(2 * np.pi) * self.sigma_b)


def mean_profile(relief: Relief, period_m: float) -> np.ndarray:
    """Mean height (samples,) in metres of a relief's periods along T, averaged over B."""
    line = np.average(relief.height_m, axis=0, weights=relief.apodisation_axes[0] + 1e-12)
    pixel = relief.pixel_size_m[1]
    count = int(np.clip(round(period_m / pixel), 1, _SAMPLES_MAX))
    x = np.arange(len(line)) * pixel
    phase = np.floor((x / period_m % 1) * count + 1e-6).astype(int) % count
    total = np.bincount(phase, line, count)
    return total / np.maximum(np.bincount(phase, minlength=count), 1)


def build(relief: Relief, settings: Settings) -> Stam:
    """Build Stam's form of a relief. Raises GratingError if the relief has no period."""
    period = grating_period(relief, settings.period_m)
    length_m = settings.coherence_length_m
    sigma_b = coherence.kernel_sigma(length_m) if length_m else coherence.narrowest_averaging_kernel(relief.size_m)
    return Stam(mean_profile(relief, period), period, sigma_b, settings)


ENTRY = MethodEntry("stam", "ensemble", build)
