# SPDX-License-Identifier: GPL-3.0-or-later
"""Direction pairs on which the hard cases are compared with the reference."""

import numpy as np

from precompute.bake.needs import Needs
from precompute.bake.shown_directions import joined, needs_of, under_lamp
from precompute.colour.observer import WAVELENGTH_MIN_M
from precompute.measure import truths
from precompute.measure.errors import Pairs, Truth
from precompute.optics.region import Region
from precompute.reference.reference import reference_xyz
from precompute.surface.relief import Relief

W_COUNT, PAIRS = 3, 150
# The coarsest wavelength step that resolves the colour matching functions.
STEP_MAX_M = 3e-9
GRAZING = np.radians(89.9)
# The smallest needs a request can state: a fifth of a texel at this coherence.
ONE_TEXEL = Needs(Region((0.2, 0.22), (0.1, 0.12)), (1.5, 1.52))


def wavelength_step(sigma_b: float) -> float:
    """The wavelength step of the reference, in metres.

    Between neighbouring wavelengths an order at |u| = 2 moves by at most two sigma_b: Gaussians at that distance add up
    to a constant within 1.4 %. An order at |u| = 1 moves by at most one sigma_b, where the sum is constant within 5e-9.
    """
    return min(STEP_MAX_M, sigma_b * WAVELENGTH_MIN_M)


def anywhere(relief: Relief, sigma_b: float) -> list[Truth]:
    """Direction pairs drawn as for every error measurement (precompute/measure/truths.py)."""
    return truths.truths(relief, sigma_b, W_COUNT, pairs_each=PAIRS, step_m=wavelength_step(sigma_b), seed=7)


def grazing(relief: Relief, sigma_b: float) -> list[Truth]:
    """Light at 89.9 degrees from all azimuths, seen at 89.9, 73 and 26 degrees, up to half a radian beside the mirror
    direction. Farther away the skin is black."""
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    light, aside = polar(GRAZING, turn), 0.5 * np.sin(7 * turn)
    views = (polar(view, turn + np.pi + aside) for view in (GRAZING, np.radians(73), np.radians(26)))
    return [truth(relief, sigma_b, light, view) for view in views]


def mirrored(relief: Relief, sigma_b: float) -> list[Truth]:
    """Views in the mirror direction of the light, where u = v = 0."""
    turn = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    angles = np.radians([0, 30, 60, 80, 89])
    return [truth(relief, sigma_b, polar(angle, turn), polar(angle, turn + np.pi)) for angle in angles]


def beyond(relief: Relief, sigma_b: float) -> list[Truth]:
    """Light at 80 degrees on the side of +T, seen at 35 to 65 degrees on the same side: u from 1.5 to 1.9."""
    light = polar(np.radians(80), np.linspace(-0.03, 0.03, 60))
    return [truth(relief, sigma_b, light, polar(np.radians(view), np.full(60, 0.02))) for view in (35, 50, 65)]


def polar(theta: float, azimuth: np.ndarray) -> np.ndarray:
    """Unit directions (n, 3) at theta radians from the normal and azimuths (n,) from T."""
    sine = np.sin(theta)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.full(len(azimuth), np.cos(theta))], axis=-1)


def truth(relief: Relief, sigma_b: float, wi: np.ndarray, wr: np.ndarray) -> Truth:
    """The reference for direction pairs wi, wr (n, 3) that share one w."""
    pairs, w = Pairs(wi, wr, np.ones(len(wi), bool)), float(wi[0, 2] + wr[0, 2])
    return Truth(
        w, pairs, *reference_xyz(relief, (pairs.u, pairs.v), w=w, sigma_b=sigma_b, step_m=wavelength_step(sigma_b))
    )


def horizon(relief: Relief, sigma_b: float) -> list[Truth]:
    """Light at 89.9 degrees around +T, seen from the other side at 80, 60 and 45 degrees."""
    turn = np.linspace(-0.1, 0.1, 60)
    return [
        truth(relief, sigma_b, polar(GRAZING, turn), polar(np.radians(view), turn + np.pi)) for view in (80, 60, 45)
    ]


def horizon_needs() -> Needs:
    """The needs of the pairs of `horizon`."""
    turn, one = np.linspace(-0.1, 0.1, 60), np.ones(60)
    views = (polar(np.radians(view), turn + np.pi) for view in (80, 60, 45))
    shown = (under_lamp(wr, polar(GRAZING, turn), irradiance=one, variance=0 * one) for wr in views)
    return needs_of(joined(list(shown)))


def one_place(relief: Relief, sigma_b: float) -> list[Truth]:
    """Pairs around the middle of ONE_TEXEL; wi - wr lies in the surface, at right angles to (u, v)."""
    u, v = (np.random.default_rng(3).uniform(*side, PAIRS) for side in ONE_TEXEL.region)
    found = []
    for w in np.linspace(*ONE_TEXEL.w, W_COUNT):
        half, across = np.c_[u, v, np.full(PAIRS, w)] / 2, np.c_[-v, u, 0 * u] / np.hypot(u, v)[:, None]
        apart = across * np.sqrt(1 - (half**2).sum(axis=1))[:, None]
        found.append(truth(relief, sigma_b, half + apart, half - apart))
    return found
