# SPDX-License-Identifier: GPL-3.0-or-later
"""Efficiencies of the orders of three gratings, computed from the spectrum and by closed form, and their light.

The spectrum is computed without a window and with R = O = 1, each order m at its own w = cos(ti) + cos(tm). With
phi = 2 pi w depth / lambda the closed forms are

    sinusoidal   J_m(phi / 2)^2
    binary       cos(phi / 2)^2 for m = 0, (2 sin(phi / 2) / (pi m))^2 for odd m, 0 for other even m
    blazed       sinc(w depth / lambda + m)^2

(Goodman, Introduction to Fourier Optics, 4.4). Each is |c_m|^2, where the Fourier series of exp(-i phi h / depth) has
the coefficients c_m. The profiles are sampled at the middles of N equal parts of a period, so that a jump falls between
two samples. The sum is then the mid-point rule of the Fourier integral, whose error falls as 1 / N^2. For the smooth
sinusoidal profile only rounding is left.

A dielectric reflects into an order its efficiency times the factor G of its own form (docs/theory.md, BRDF)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from precompute.base.failure import GratingError
from precompute.maths import chebyshev
from precompute.optics.brdf import scattering_factor
from precompute.spectra.spectrum import FrequencyGrid, scattered_spectrum
from precompute.surface.relief import Relief

PROFILES = ("sinusoidal", "binary", "blazed")
SAMPLES_MIN, SAMPLES_MAX = 16, 1 << 22
ORDERS_MAX = 1000


@dataclass(frozen=True)
class Order:
    """An order's efficiency, computed and by closed form, as fractions of the reflected power, and the sine of its
    angle."""

    order: int
    computed: float
    analytic: float
    sine: float

    @property
    def error(self) -> float:
        return abs(self.computed - self.analytic)

    def as_dict(self) -> dict[str, float]:
        """A record for JSON."""
        return {"order": self.order, "computed": self.computed, "analytic": self.analytic, "error": self.error}


def profile(kind: str, depth_m: float, samples: int, *, duty: float = 0.5) -> np.ndarray:
    """Heights (samples,) in metres over one period: a sine, a ridge in the part `duty`, or a ramp up along +T."""
    x = (np.arange(samples) + 0.5) / samples
    if kind == "sinusoidal":
        return depth_m / 2 * np.sin(2 * np.pi * x)
    if kind == "binary":
        return np.where(x < duty, depth_m, 0.0)
    return depth_m * x


def analytic_efficiency(kind: str, order: int, turns: float) -> float:
    """The closed form at turns = w * depth / lambda >= 0, the path difference in wavelengths."""
    if kind == "sinusoidal":
        return float(chebyshev.bessel_j(np.pi * turns, abs(order) + 1)[abs(order)] ** 2)
    if kind == "binary":
        if order == 0:
            return float(np.cos(np.pi * turns) ** 2)
        return float((2 * np.sin(np.pi * turns) / (np.pi * order)) ** 2) if order % 2 else 0.0
    return float(np.sinc(turns + order) ** 2)


def efficiencies(
    kind: str, *, period_m: float, depth_m: float, wavelength_m: float, theta_i: float = 0.0, orders: int = 3,
    samples: int = 2048,
) -> list[Order]:  # fmt: skip
    """The propagating orders among -orders to orders, for light from the side of -T at theta_i radians from the normal.

    `kind` is one of PROFILES; `samples` is the number of samples in a period. Order m leaves towards +T at sin(tm) = m
    lambda / period + sin(ti). Raises GratingError if the grating or the light is outside the allowed ranges."""
    _check_grating(kind, period_m, depth_m)
    _check_light(wavelength_m, theta_i)
    _check_counts(orders, samples)
    height = profile(kind, depth_m, samples)[None, :]
    relief = Relief(
        height - height.mean(), (np.ones(1), np.ones(samples)), (period_m, period_m / samples), periodic=True
    )
    wanted = np.arange(-orders, orders + 1)
    grid = FrequencyGrid(np.zeros(1), wanted / period_m, height.shape)
    found = []
    for order in wanted.tolist():
        sine = order * wavelength_m / period_m + np.sin(theta_i)
        if abs(sine) >= 1:
            continue
        s = (np.cos(theta_i) + np.sqrt(1 - sine**2)) / wavelength_m
        scattered, zero_order = scattered_spectrum(relief, s, grid)
        computed = scattered[0, order + orders] if order else zero_order
        found.append(Order(order, float(computed), analytic_efficiency(kind, order, s * depth_m), float(sine)))
    return found


def reflected(orders: Sequence[Order], theta_i: float, ior: float) -> np.ndarray:
    """Fractions (n,) of the incident light that a dielectric reflects into each order, by the small slope form.

    theta_i is the angle of the light in radians, ior the index of refraction from 1 to IOR_MAX."""
    sine = np.array([one.sine for one in orders])
    wr = np.stack([sine, np.zeros_like(sine), np.sqrt(1 - sine**2)], axis=-1)
    wi = np.broadcast_to([-np.sin(theta_i), 0, np.cos(theta_i)], wr.shape)
    w = wi[:, 2] + wr[:, 2]
    return scattering_factor(wi, wr, ior) / (wi[:, 2] * w**2) * [one.computed for one in orders]


def largest_order(period_m: float, wavelength_m: float, theta_i: float) -> int:
    """The largest |order| that leaves the surface, for light at theta_i radians."""
    return int((1 + abs(np.sin(theta_i))) * period_m / wavelength_m)


def _check_grating(kind: str, period_m: float, depth_m: float) -> None:
    if kind not in PROFILES:
        raise GratingError(kind, "not a grating with a closed form", f"choose one of {', '.join(PROFILES)}")
    if not 0 < period_m < 1:
        raise GratingError(f"period of {period_m / 1e-6:g} um", "", "give a length above 0")
    if not 0 <= depth_m < 1e-3:
        raise GratingError(f"depth of {depth_m * 1e9:g} nm", "", "give 0 or more, up to a millimetre")


def _check_light(wavelength_m: float, theta_i: float) -> None:
    if not 0 < wavelength_m < 1:
        raise GratingError(f"wavelength of {wavelength_m / 1e-9:g} nm", "", "give a length above 0")
    if not abs(theta_i) < np.pi / 2:
        raise GratingError(
            f"--theta-i {np.degrees(theta_i):g}", "below the surface", "give an angle between -90 and 90"
        )


def _check_counts(orders: int, samples: int) -> None:
    if not 0 <= orders <= ORDERS_MAX:
        raise GratingError(f"--orders {orders}", "not a number of orders", f"give 0 to {ORDERS_MAX}")
    least = max(SAMPLES_MIN, 2 * orders + 2)
    if not least <= samples <= SAMPLES_MAX or samples % 2:
        raise GratingError(f"--samples {samples}", "", f"give an even number from {least} to {SAMPLES_MAX}")
