# SPDX-License-Identifier: GPL-3.0-or-later
"""A method's response over wavelength and viewing angle, in the plane of incidence (thesis Algorithm 6).

The light comes from -T at theta_i, as in the BRDF maps, and the view moves in the plane of incidence, over the first
order. Viewing angles are the thesis's, theta_v = asin(lambda / d - sin theta_i), negative on the side away from the
light, so that

    u = -(sin theta_i + sin theta_v),   w = cos theta_i + cos theta_v,   v = 0.

The response is the density over (u, v) alone; R and O, which are smooth and the same for all methods, are left out.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..base.failure import GratingError
from ..maths import chebyshev
from ..methods.exact import Ensemble, Patch
from ..methods.method import Method
from ..reference.ensemble import KERNEL_REACH, reference_grid
from ..spectra.resample import Resampler
from ..spectra.series import spectrum_series
from ..spectra.spectrum import phasor

ANGLE_STEP = np.radians(0.02)


# A peak is looked for where u is that of the first order of the period, to this share.
WINDOW = 0.25


# Interpolation of the references in s; their methods' own direct sums agree to the same (a test).
_EXACT = 1e-10


@dataclass(frozen=True)
class Plane:
    """Views in the plane of incidence: light at theta_i, views at theta_v (n,), ascending, all in radians."""

    theta_i: float
    theta_v: np.ndarray

    @property
    def u(self) -> np.ndarray:
        """Along T (n,), descending: the light is on the side of -T."""
        return -(np.sin(self.theta_i) + np.sin(self.theta_v))

    @property
    def w(self) -> np.ndarray:
        """Along the normal (n,)."""
        return np.cos(self.theta_i) + np.cos(self.theta_v)


def first_order_angle(theta_i: float, lambdas_m, period_m: float) -> np.ndarray:
    """theta_v (n,) in radians of the first order. Raises GratingError where there is none above the horizon."""
    sine = np.asarray(lambdas_m) / period_m - np.sin(theta_i)
    if np.any(np.abs(sine) >= 1):
        raise GratingError(
            f"a period of {period_m * 1e9:.0f} nm has no first order at {np.max(lambdas_m) * 1e9:.0f} nm with the "
            f"light at {np.degrees(theta_i):.1f} degrees; give another --theta-i or --period-nm"
        )
    return np.arcsin(sine)


def first_order_plane(theta_i: float, lambdas_m: np.ndarray, period_m: float, step: float = ANGLE_STEP) -> Plane:
    """Views `step` radians apart, over the windows of all wavelengths.

    They are odd multiples of half a step, whatever the period, so that no expected angle is among them but by chance: a
    grid that held them would give the asked period back."""
    first_order_angle(theta_i, lambdas_m, period_m)
    reach = np.array([(1 - WINDOW) * np.min(lambdas_m), (1 + WINDOW) * np.max(lambdas_m)]) / period_m
    low, high = np.arcsin(np.clip(reach - np.sin(theta_i), -1, 1))
    high = min(high, np.pi / 2 - step)
    return Plane(theta_i, (np.arange(np.floor(low / step), np.ceil(high / step)) + 0.5) * step)


def response(method: Method, plane: Plane, lambdas_m: np.ndarray) -> np.ndarray:
    """Density over (u, v) (wavelengths, views)."""
    if isinstance(method, Ensemble):
        return _ensemble_response(method, plane, lambdas_m)
    if isinstance(method, Patch):
        return _patch_response(method, plane, lambdas_m)
    zeros = np.zeros(len(plane.theta_v))
    return np.stack([method.density(plane.u, zeros, plane.w, lam) for lam in lambdas_m])


def _ensemble_response(method: Ensemble, plane: Plane, lambdas_m) -> np.ndarray:
    """The reference's density with its spectra interpolated in s: every view has its own w, and one transform for each
    view and wavelength would take hours."""
    sigma = method.sigma_b
    grid = reference_grid(method.relief, sigma)
    reach = KERNEL_REACH * sigma / np.min(lambdas_m)
    grid = replace(grid, q_y=grid.q_y[np.abs(grid.q_y) <= reach])
    series = spectrum_series(method.relief, grid, plane.w.max() / np.min(lambdas_m), tolerance=_EXACT)
    ascending = plane.u[::-1]
    rows = []
    for lam in lambdas_m:
        resample = Resampler(grid, ascending, np.zeros(1), lam, sigma)
        weights = series.weights(plane.w / lam) * (plane.w / lam)[:, None] ** 2
        blurred = np.stack([resample(power[resample.kept])[0, ::-1] for power in series.scattered_over_s2], axis=-1)
        kernel = np.exp(-0.5 * (plane.u / sigma) ** 2) / (2 * np.pi * sigma**2)
        # Interpolation leaves some 1e-10 of the peak below zero.
        scattered = np.maximum(np.sum(weights * blurred, axis=-1), 0)
        rows.append(scattered + series.zero_order(plane.w / lam) * kernel)
    return np.stack(rows)


def _patch_response(method: Patch, plane: Plane, lambdas_m) -> np.ndarray:
    """The patch's density with its amplitudes interpolated in s, in which they are band limited by the relief."""
    window, relief = method.window, method.window.relief
    s_max = plane.w.max() / np.min(lambdas_m)
    count = chebyshev.jacobi_anger_terms(np.pi * s_max * relief.height_range_m, _EXACT)
    along_b = window.waves(0, np.zeros(1))[0]
    lines = np.stack(
        [along_b @ (relief.apodisation * phasor(relief.height_m, s)) for s in chebyshev.nodes(count, 0, s_max)], axis=-1
    )
    rows = []
    for lam in lambdas_m:
        weights = chebyshev.interpolation_matrix(plane.w / lam, count, lower=0, upper=s_max)
        amplitude = np.sum(window.waves(1, plane.u / lam) @ lines * weights, axis=-1)
        rows.append(window.density_scale() * np.abs(amplitude) ** 2 / lam**2)
    return np.stack(rows)
