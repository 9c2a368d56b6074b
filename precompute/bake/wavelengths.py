# SPDX-License-Identifier: GPL-3.0-or-later
"""The wavelengths that a bake sums, and how many they are."""

import math

import numpy as np

from ..colour.illuminants import has_bands
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, seen_wavelengths
from .request import BakeRequest

# The refractive index of films that light crosses without being absorbed, at most.
_FILM_INDEX = 2.5


def wavelengths_of(sigma_b: float, request: BakeRequest) -> np.ndarray:
    """The wavelengths (n,) in metres that a request's table sums: those of bake_wavelengths that its illuminant has."""
    reach, light = request.needs.region.reach, request.illuminant
    steps = len(bake_wavelengths(sigma_b, request.delta_e, reach, illuminant=light)) - 1
    films_m = sum(layer.thickness_nm for layer in request.matter.layers) * 1e-9
    # With this many steps per unit of the logarithm, neighbours are an eighth of the films' finest fringe apart: the
    # phase of a round trip is at most 4 pi n thickness / wavelength, with n up to _FILM_INDEX.
    steps_per_log = 16 * _FILM_INDEX * films_m / WAVELENGTH_MIN_M
    steps = max(steps, math.ceil(math.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) * steps_per_log))
    return seen_wavelengths(np.geomspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, steps + 1), light)


def bake_wavelengths(
    sigma_b: float, delta_e: float = 1.0, reach: float = 2.0, *, illuminant: str = "D65"
) -> np.ndarray:
    """Wavelengths (n,) in metres, equally spaced in their logarithm.

    At |u| = reach, an order moves by f sigma_b from one wavelength to the next. A sum of Gaussians at this spacing is
    flat to 2 exp(-2 pi^2 / f^2) (Poisson's formula). f is chosen so that this is 0.1 % for a dE00 of 1, and in
    proportion for another dE00. The colour matching functions need at least 80 steps.

    Under an illuminant of narrow bands, an order's light at a band is interpolated between two wavelengths. Cubic
    convolution of a Gaussian is off by 0.4 % of its peak at half a standard deviation, in proportion to the spacing's
    third power. So f is a half for a dE00 of 1; a quarter as much, at |u| = reach / 2, is off by 0.04 %."""
    spacing = math.pi * math.sqrt(2 / math.log(2 / min(1e-3 * delta_e, 0.1)))
    if has_bands(illuminant):
        spacing = min(spacing, 0.5 * min(delta_e, 3.0) ** (1 / 3))
    step = min(spacing * sigma_b / reach, np.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) / 80)
    count = int(np.ceil(np.log(WAVELENGTH_MAX_M / WAVELENGTH_MIN_M) / step)) + 1
    return np.geomspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, count)
