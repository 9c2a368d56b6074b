# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference of both coherence models: exact phasor, float64, the transform at the asked frequencies, no expansion.

Ensemble: precompute.reference. Patch: the sum of precompute.methods.patch_window, written out as matrix products.
"""

from dataclasses import dataclass

import numpy as np

from ..optics import coherence
from ..reference import ensemble
from ..reference.ensemble import reference_grid
from ..spectra.patch_window import PatchWindow
from ..spectra.spectrum import phasor, scattered_spectrum
from ..surface.relief import Relief
from .method import Settings, spectral_sum

# Complex numbers in one block of waves.
_CHUNK = 2_000_000


@dataclass(frozen=True)
class Ensemble:
    """Power spectrum blurred by a kernel sigma_b in (u, v); one transform for every pair of w and wavelength."""

    relief: Relief
    sigma_b: float
    settings: Settings
    name: str = "reference"
    coherence: str = "ensemble"

    def density(self, u, v, w, wavelength_m) -> np.ndarray:
        """See Method."""
        u, v, w = np.broadcast_arrays(u, v, w)
        grid = reference_grid(self.relief, self.sigma_b)
        out = np.empty(len(u))
        for one in np.unique(w):
            at = w == one
            power, zero_order = scattered_spectrum(self.relief, one / wavelength_m, grid)
            kernel = np.exp(-(u[at] ** 2 + v[at] ** 2) / (2 * self.sigma_b**2)) / (2 * np.pi * self.sigma_b**2)
            blurred = ensemble.blurred(power, grid, u[at], v[at], wavelength_m, self.sigma_b)
            out[at] = blurred + zero_order * kernel
        return out

    def xyz(self, u, v, w) -> np.ndarray:
        """See Method."""
        return spectral_sum(self.density, u, v, w, self.settings)


@dataclass(frozen=True)
class Patch:
    """The direct transform of the repeated patch under its window."""

    window: PatchWindow
    settings: Settings
    name: str = "reference-patch"
    coherence: str = "patch"

    def density(self, u, v, w, wavelength_m) -> np.ndarray:
        """See Method; wavelength_m may be (n,)."""
        u, v, w, lam = np.broadcast_arrays(u, v, w, wavelength_m)
        amplitude = np.empty(len(u), complex)
        step = max(1, _CHUNK // sum(self.window.relief.height_m.shape))
        sums = self._line_sums if _is_line_grating(self.window.relief) else self._sums
        for start in range(0, len(u), step):
            part = slice(start, start + step)
            amplitude[part] = sums(v[part] / lam[part], u[part] / lam[part], w[part] / lam[part])
        return self.window.density_scale() * np.abs(amplitude) ** 2 / lam**2

    def xyz(self, u, v, w) -> np.ndarray:
        """See Method."""
        return spectral_sum(self.density, u, v, w, self.settings)

    def _sums(self, q_y, q_x, s) -> np.ndarray:
        out = np.empty(len(s), complex)
        waves_y, waves_x = self.window.waves(0, q_y), self.window.waves(1, q_x)
        relief = self.window.relief
        for one in np.unique(s):
            at = s == one
            field = relief.taper * phasor(relief.height_m, one)
            out[at] = np.einsum("ny,yn->n", waves_y[at], field @ waves_x[at].T)
        return out

    def _line_sums(self, q_y, q_x, s) -> np.ndarray:
        """As _sums where all rows are alike: the two axes part."""
        relief = self.window.relief
        taper_y, taper_x = relief.tapers
        line = np.exp((-2j * np.pi) * s[:, None] * relief.height_m[0])
        along_x = np.einsum("nx,nx,x->n", self.window.waves(1, q_x), line, taper_x)
        return self.window.waves(0, q_y) @ taper_y * along_x


def _is_line_grating(relief: Relief) -> bool:
    return bool(np.all(relief.height_m == relief.height_m[0]))


def build_ensemble(relief: Relief, settings: Settings) -> Ensemble:
    """The ensemble model's reference."""
    length_m = settings.coherence_length_m
    sigma_b = coherence.kernel_sigma(length_m) if length_m else coherence.narrowest_sound_kernel(relief.size_m)
    return Ensemble(relief, sigma_b, settings)


def build_patch(relief: Relief, settings: Settings) -> Patch:
    """The patch model's reference."""
    return Patch(PatchWindow(relief, settings.patch_sigma_m), settings)
