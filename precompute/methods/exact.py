# SPDX-License-Identifier: GPL-3.0-or-later
"""The references of both models of coherence (precompute.reference) in the shape of a method."""

from dataclasses import dataclass

import numpy as np

from ..optics import coherence
from ..reference import ensemble
from ..reference.ensemble import reference_grid
from ..reference.patch import PatchReference
from ..spectra.patch_window import PatchWindow
from ..spectra.spectrum import scattered_spectrum
from ..surface.relief import Relief
from .method import Settings, spectral_sum


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
        return PatchReference(self.window).density(u, v, w, wavelength_m)

    def xyz(self, u, v, w) -> np.ndarray:
        """See Method."""
        return spectral_sum(self.density, u, v, w, self.settings)


def build_ensemble(relief: Relief, settings: Settings) -> Ensemble:
    """The ensemble model's reference."""
    length_m = settings.coherence_length_m
    sigma_b = coherence.kernel_sigma(length_m) if length_m else coherence.narrowest_averaging_kernel(relief.size_m)
    return Ensemble(relief, sigma_b, settings)


def build_patch(relief: Relief, settings: Settings) -> Patch:
    """The patch model's reference."""
    return Patch(PatchWindow(relief, settings.patch_sigma_m), settings)
