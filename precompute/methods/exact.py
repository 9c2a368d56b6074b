# SPDX-License-Identifier: GPL-3.0-or-later
"""The references of both models of coherence (precompute/reference) as methods.

Each computes its densities in two ways. `density` sums directly, with one transform per pair of w and wavelength.
`densities_in_plane` interpolates in s between exact spectra, which makes a plane of views affordable.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..maths import chebyshev
from ..optics import coherence
from ..reference import reference
from ..reference.reference import KERNEL_REACH, PatchReference, reference_grid
from ..spectra.series import Resampler, spectrum_series
from ..spectra.spectrum import PatchWindow, phasor, scattered_spectrum
from ..surface.relief import Relief
from .method import Coherence, Method, MethodEntry, Settings

# Tolerance of the interpolation in s. A test compares the result with the direct sums.
_EXACT = 1e-10


@dataclass(frozen=True)
class Ensemble(Method):
    """The power spectrum blurred by a kernel sigma_b in (u, v); one transform for every pair of w and wavelength."""

    relief: Relief
    sigma_b: float
    settings: Settings
    name: str = "reference"
    coherence: Coherence = "ensemble"

    def density(self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float, *, wavelength_m: float) -> np.ndarray:
        """See Method."""
        u, v, w = np.broadcast_arrays(u, v, w)
        grid = reference_grid(self.relief, self.sigma_b)
        out = np.empty(len(u))
        for one in np.unique(w):
            at = w == one
            power, zero_order = scattered_spectrum(self.relief, one / wavelength_m, grid)
            kernel = np.exp(-(u[at] ** 2 + v[at] ** 2) / (2 * self.sigma_b**2)) / (2 * np.pi * self.sigma_b**2)
            blurred = reference.blurred(power, grid, (u[at], v[at]), lam=wavelength_m, sigma_b=self.sigma_b)
            out[at] = blurred + zero_order * kernel
        return out

    def densities_in_plane(self, u: np.ndarray, w: np.ndarray, lambdas_m: np.ndarray) -> np.ndarray:
        """See Method. The spectra are interpolated in s, because every view has its own w, and a transform for each
        pair of view and wavelength would take hours."""
        sigma = self.sigma_b
        grid = reference_grid(self.relief, sigma)
        reach = KERNEL_REACH * sigma / np.min(lambdas_m)
        grid = replace(grid, q_y=grid.q_y[np.abs(grid.q_y) <= reach])
        series = spectrum_series(self.relief, grid, w.max() / np.min(lambdas_m), tolerance=_EXACT)
        ascending = u[::-1]
        rows = []
        for lam in lambdas_m:
            resample = Resampler(grid, ascending, np.zeros(1), lam, grid.kernel_left(sigma, lam))
            weights = series.weights(w / lam) * (w / lam)[:, None] ** 2
            blurred = np.stack([resample(power[resample.kept])[0, ::-1] for power in series.scattered_over_s2], axis=-1)
            kernel = np.exp(-0.5 * (u / sigma) ** 2) / (2 * np.pi * sigma**2)
            # Interpolation leaves about -1e-10 of the peak.
            scattered = np.maximum(np.sum(weights * blurred, axis=-1), 0)
            rows.append(scattered + series.zero_order(w / lam) * kernel)
        return np.stack(rows)

    @property
    def table_bytes(self) -> int:
        """Bytes of the heights."""
        return self.relief.height_m.nbytes


@dataclass(frozen=True)
class Patch(Method):
    """The direct transform of the repeated patch under its window."""

    window: PatchWindow
    settings: Settings
    name: str = "reference-patch"
    coherence: Coherence = "patch"

    def density(
        self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float, *, wavelength_m: np.ndarray | float
    ) -> np.ndarray:
        """See Method; wavelength_m may be (n,)."""
        return PatchReference(self.window).density(u, v, w, wavelength_m=wavelength_m)

    def densities_in_plane(self, u: np.ndarray, w: np.ndarray, lambdas_m: np.ndarray) -> np.ndarray:
        """See Method. The amplitudes are interpolated in s; the relief's height range limits their bandwidth in s."""
        window, relief = self.window, self.window.relief
        s_max = w.max() / np.min(lambdas_m)
        count = chebyshev.jacobi_anger_terms(np.pi * s_max * relief.height_range_m, _EXACT)
        along_b = window.waves(0, np.zeros(1))[0]
        nodes = chebyshev.nodes(count, lower=0, upper=s_max)
        lines = np.stack([along_b @ (relief.apodisation * phasor(relief.height_m, s)) for s in nodes], axis=-1)
        rows = []
        for lam in lambdas_m:
            weights = chebyshev.interpolation_matrix(w / lam, count, lower=0, upper=s_max)
            amplitude = np.sum(window.waves(1, u / lam) @ lines * weights, axis=-1)
            rows.append(window.density_scale() * np.abs(amplitude) ** 2 / lam**2)
        return np.stack(rows)

    @property
    def table_bytes(self) -> int:
        """Bytes of the heights."""
        return self.window.relief.height_m.nbytes


def build_ensemble(relief: Relief, settings: Settings) -> Ensemble:
    """Build the ensemble model's reference."""
    length_m = settings.coherence_length_m
    sigma_b = coherence.kernel_sigma(length_m) if length_m else coherence.narrowest_averaging_kernel(relief.size_m)
    return Ensemble(relief, sigma_b, settings)


def build_patch(relief: Relief, settings: Settings) -> Patch:
    """Build the patch model's reference."""
    return Patch(PatchWindow(relief, settings.patch_sigma_m), settings)


ENTRIES = (
    MethodEntry("reference", "ensemble", build_ensemble),
    # It sums over every pixel for every direction, so a picture would take hours.
    MethodEntry("reference-patch", "patch", build_patch, in_maps=False),
)
