# SPDX-License-Identifier: GPL-3.0-or-later
"""A method's response over wavelength and viewing angle, in the plane of incidence (thesis Algorithm 6).

The light comes from -T at theta_i, as in the BRDF maps. The view moves in the plane of incidence, over the first order.
Viewing angles follow the thesis: theta_v = asin(lambda / d - sin theta_i), negative on the side away from the light, so
that

    u = -(sin theta_i + sin theta_v),   w = cos theta_i + cos theta_v,   v = 0.

The response is the density over (u, v). It leaves out R and O, which are smooth and the same for all methods."""

from dataclasses import dataclass, field

import numpy as np

from precompute.base.failure import GratingError
from precompute.colour.observer import wavelengths
from precompute.methods.method import Method

ANGLE_STEP = np.radians(0.02)
# Peaks are searched where u differs from the u of the first order by at most this share.
WINDOW = 0.25


@dataclass(frozen=True)
class Plane:
    """Views in the plane of incidence: light at theta_i, views at theta_v (n,), ascending, all in radians."""

    theta_i: float
    theta_v: np.ndarray

    @property
    def u(self) -> np.ndarray:
        """Coordinate along T (n,), descending; the light is on the side of -T."""
        return -(np.sin(self.theta_i) + np.sin(self.theta_v))

    @property
    def w(self) -> np.ndarray:
        """Coordinate along the normal (n,)."""
        return np.cos(self.theta_i) + np.cos(self.theta_v)


def first_order_angle(theta_i: float, lambdas_m, period_m: float) -> np.ndarray:
    """Viewing angles theta_v (n,) of the first order, in radians. Raises GratingError if one is below the horizon."""
    sine = np.asarray(lambdas_m) / period_m - np.sin(theta_i)
    if np.any(np.abs(sine) >= 1):
        raise GratingError(
            "",
            f"a period of {period_m * 1e9:.0f} nm has no first order at {np.max(lambdas_m) * 1e9:.0f} nm with the "
            f"light at {np.degrees(theta_i):.1f} degrees",
            "give another --theta-i or --period-nm",
        )
    return np.arcsin(sine)


def first_order_plane(theta_i: float, lambdas_m: np.ndarray, period_m: float, *, step: float = ANGLE_STEP) -> Plane:
    """Views `step` radians apart that cover the windows of all wavelengths.

    The views are odd multiples of half a step for every period. A grid that contained the expected angles would bias
    the result towards the period from which it was made. Raises GratingError if the period has no first order above the
    horizon."""
    first_order_angle(theta_i, lambdas_m, period_m)
    reach = np.array([(1 - WINDOW) * np.min(lambdas_m), (1 + WINDOW) * np.max(lambdas_m)]) / period_m
    low, high = np.arcsin(np.clip(reach - np.sin(theta_i), -1, 1))
    high = min(high, np.pi / 2 - step)
    return Plane(theta_i, (np.arange(np.floor(low / step), np.ceil(high / step)) + 0.5) * step)


@dataclass(frozen=True)
class FirstOrder:
    """The first order under study: light at theta_i radians on a grating of period_m metres, wavelengths lambdas_m (n,)
    in metres, views `step` radians apart."""

    theta_i: float
    period_m: float
    lambdas_m: np.ndarray = field(default_factory=lambda: wavelengths(5e-9))
    step: float = ANGLE_STEP

    @property
    def plane(self) -> Plane:
        """The views. Raises GratingError if the first order is below the horizon."""
        return first_order_plane(self.theta_i, self.lambdas_m, self.period_m, step=self.step)


def response(method: Method, plane: Plane, lambdas_m: np.ndarray) -> np.ndarray:
    """A method's density over (u, v), of shape (wavelengths, views)."""
    return method.densities_in_plane(plane.u, plane.w, lambdas_m)
