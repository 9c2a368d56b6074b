# SPDX-License-Identifier: GPL-3.0-or-later
"""References of both models of coherence: exact phasor, float64, no table and no expansion in s.

They are deliberately slow and simple. The ensemble model takes one transform per w and wavelength, in steps of 1 nm,
and sums over the kernel's bins. The patch model takes the sum P(q; s) of precompute/spectra/spectrum.py for each
direction, as a product of matrices."""

from dataclasses import dataclass

import numpy as np

from ..base.progress import Progress, silent
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, spectral_weights, wavelengths
from ..reflectance.matter import MIRRORING, Matter, half_angle_cosines
from ..spectra.spectrum import FrequencyGrid, PatchWindow, frequency_grid, phasor, scattered_spectrum
from ..surface.relief import Relief

# The kernel ends at this many standard deviations, where it has fallen to exp(-7^2 / 2) = 2e-11 of its peak. The tail
# beyond is less than 1e-9, the accuracy of the reference.
KERNEL_REACH = 7.0


def reference_grid(relief: Relief, sigma_b: float) -> FrequencyGrid:
    """Every bin that a kernel of sigma_b in (u, v) can reach from |u|, |v| <= 2, at any visible wavelength."""
    return frequency_grid(relief, (2 + KERNEL_REACH * sigma_b) / WAVELENGTH_MIN_M, sigma_b / WAVELENGTH_MAX_M)


def reference_xyz(
    relief: Relief, uv: tuple[np.ndarray, np.ndarray], *, w: float, sigma_b: float, step_m: float = 1e-9,
    matter: Matter = MIRRORING, progress: Progress = silent,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Scattered XYZ (n, 3) at the places uv, two arrays (n,), and the zero order's XYZ (3,), all at one w.

    XYZ is the integral over wavelength of PSD((u, v) / lambda; w / lambda) / lambda^2 times the observer: the
    density over (u, v) of the light that a surface of a matter and of the obliquity O = 1 reflects, scaled so that a
    perfect mirror's white, D65, has Y = 1. The zero order's XYZ multiplies the kernel (docs/theory.md, "The bake").
    `progress` is called after each wavelength.

    >>> relief = prepare(read_height_map("sample:blazed"))
    >>> uv = np.array([0.2, 0.3]), np.zeros(2)
    >>> scattered, zero_order = reference_xyz(relief, uv, w=1.8, sigma_b=0.04, step_m=50e-9)
    >>> scattered.shape, zero_order.shape
    ((2, 3), (3,))"""
    grid = reference_grid(relief, sigma_b)
    lambdas = wavelengths(step_m)
    weights = spectral_weights(lambdas, "D65")
    scattered = np.zeros((len(uv[0]), 3))
    # The last cosine is the zero order's, whose half vector is the normal.
    reflectance = matter.reflectance(lambdas, np.append(half_angle_cosines(*uv, w), w / 2))
    zero_order = np.zeros(3)
    for k, (lam, weight) in enumerate(zip(lambdas, weights, strict=True)):
        power, efficiency = scattered_spectrum(relief, w / lam, grid)
        scattered += (blurred(power, grid, uv, lam=lam, sigma_b=sigma_b) * reflectance[k, :-1])[:, None] * weight
        zero_order += efficiency * reflectance[k, -1] * weight
        progress("reference", (k + 1) / len(lambdas))
    return scattered, zero_order


def blurred(
    power: np.ndarray, grid: FrequencyGrid, uv: tuple[np.ndarray, np.ndarray], *, lam: float, sigma_b: float,
    cut: float = KERNEL_REACH,
) -> np.ndarray:  # fmt: skip
    """Density (n,) over (u, v) of the binned power (ny, nx) under a kernel sigma_b, at the places uv, two arrays (n,).

    The light of each bin is spread about lambda * q as a Gaussian, cut off at `cut` standard deviations. It is narrower
    than sigma_b by what the apodisation window adds."""
    u, v = uv
    sigma_v, sigma_u = grid.kernel_left(sigma_b, lam)
    index_y, kernel_y = _kernel_bins(grid.q_y, v, lam, sigma_v, cut)
    index_x, kernel_x = _kernel_bins(grid.q_x, u, lam, sigma_u, cut)
    density = np.empty(len(u))
    chunk = max(1, 4_000_000 // (index_y.shape[1] * index_x.shape[1]))
    for start in range(0, len(u), chunk):
        part = slice(start, start + chunk)
        bins = power[index_y[part, :, None], index_x[part, None, :]]
        density[part] = np.einsum("nyx,ny,nx->n", bins, kernel_y[part], kernel_x[part], optimize=False)
    return density


def _kernel_bins(
    q: np.ndarray, position: np.ndarray, lam: float, sigma: float, cut: float
) -> tuple[np.ndarray, np.ndarray]:
    """For each position (n,) in u or v, the indices of the bins within the kernel's reach and the kernel's values
    there. Both are arrays (n, m), where m bins are enough for every position."""
    if len(q) == 1:
        centre = np.zeros((len(position), 1), int)
    else:
        spacing = q[1] - q[0]
        reach = int(np.ceil(cut * sigma / (lam * spacing)))
        nearest = np.rint((np.asarray(position) / lam - q[0]) / spacing).astype(int)
        centre = nearest[:, None] + np.arange(-reach, reach + 1)
    inside = (centre >= 0) & (centre < len(q))
    index = np.clip(centre, 0, len(q) - 1)
    distance = (np.asarray(position)[:, None] - lam * q[index]) / sigma
    return index, inside * np.exp(-0.5 * distance**2) / (np.sqrt(2 * np.pi) * sigma)


# Complex numbers in one block of waves, to limit memory.
_CHUNK = 2_000_000


@dataclass(frozen=True)
class PatchReference:
    """The direct transform of the repeated patch under its window: exact phasor, float64, no expansion."""

    window: PatchWindow

    def density(
        self, u: np.ndarray, v: np.ndarray, w: np.ndarray | float, *, wavelength_m: np.ndarray | float
    ) -> np.ndarray:
        """Density (n,) over (u, v) of the reflected light at u, v (n,), for R = O = 1.

        w and wavelength_m, in metres, are (n,) or one number."""
        u, v, w, lam = np.broadcast_arrays(u, v, w, wavelength_m)
        amplitude = np.empty(len(u), complex)
        step = max(1, _CHUNK // sum(self.window.relief.height_m.shape))
        sums = self._line_sums if _is_line_grating(self.window.relief) else self._sums
        for start in range(0, len(u), step):
            part = slice(start, start + step)
            amplitude[part] = sums(v[part] / lam[part], u[part] / lam[part], w[part] / lam[part])
        return self.window.density_scale() * np.abs(amplitude) ** 2 / lam**2

    def _sums(self, q_y: np.ndarray, q_x: np.ndarray, s: np.ndarray) -> np.ndarray:
        out = np.empty(len(s), complex)
        waves_y, waves_x = self.window.waves(0, q_y), self.window.waves(1, q_x)
        relief = self.window.relief
        for one in np.unique(s):
            at = s == one
            field = relief.apodisation * phasor(relief.height_m, one)
            out[at] = np.einsum("ny,yn->n", waves_y[at], field @ waves_x[at].T)
        return out

    def _line_sums(self, q_y: np.ndarray, q_x: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Like _sums, for a relief that is constant along y: the product of a sum over y and a sum over x."""
        relief = self.window.relief
        apodisation_y, apodisation_x = relief.apodisation_axes
        line = np.exp((-2j * np.pi) * s[:, None] * relief.height_m[0])
        along_x = np.einsum("nx,nx,x->n", self.window.waves(1, q_x), line, apodisation_x)
        return self.window.waves(0, q_y) @ apodisation_y * along_x


def _is_line_grating(relief: Relief) -> bool:
    return bool(np.all(relief.height_m == relief.height_m[0]))
