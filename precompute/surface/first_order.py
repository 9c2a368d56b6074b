# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility of a relief's waves: which ones diffract visibly, and how much light their first order gets.

A wave of period d sends its first order to sin(tr) = lambda / d - sin(ti). The angles ti of light and tr of view are
measured from the normal, in the plane of the grating vector. For a sine of amplitude a much lower than the wavelength,
the efficiency is J1(2 pi a w / lambda)^2 = (pi a w / lambda)^2, with w = cos(ti) + cos(tr) (Goodman, Introduction to
Fourier Optics, 4.4; docs/theory.md)."""

from functools import cache

import numpy as np

from ..colour.observer import WAVELENGTH_MIN_M, spectral_weights, wavelengths

# A finer period has no first order even at grazing light and view, since lambda / d = sin(ti) + sin(tr) is at most 2.
FINEST_PERIOD_M = WAVELENGTH_MIN_M / 2
# The sun is 0.533 degrees wide. A coarser period separates red and green (the sRGB primaries' dominant wavelengths, 611
# and 549 nm) by less, so the sun's images in all colours overlap to white.
COARSEST_PERIOD_M = (611e-9 - 549e-9) / np.radians(0.533)
_ANGLES = np.radians(np.arange(-89.0, 90.0, 2.0))
_FREQUENCIES = 200


def visible_share(q: np.ndarray) -> np.ndarray:
    """Return the share of visible light (D65, by luminance) in the first order of a low sine of frequency q (...,) in
    cycles per metre, divided by the square of its amplitude in metres.

    It is the cosine-weighted mean over light from all angles in the grating vector's plane; 0 if nothing is visible."""
    known, shares = _known()
    return np.where((q >= known[0]) & (q <= known[-1]), np.interp(q, known, shares), 0.0)


@cache
def _known() -> tuple[np.ndarray, np.ndarray]:
    """Tabulate visible_share at frequencies (n,) from the coarsest to the finest period that diffracts visibly."""
    q = np.linspace(1 / COARSEST_PERIOD_M, 1 / FINEST_PERIOD_M, _FREQUENCIES)
    return q, _shares(q)


def _shares(q: np.ndarray) -> np.ndarray:
    """Compute visible_share at frequencies q (n,)."""
    lambdas = wavelengths(5e-9)
    luminance = spectral_weights(lambdas, "D65")[:, 1]
    total = np.zeros(len(q))
    for lam, weight in zip(lambdas, luminance / luminance.sum(), strict=True):
        sine = lam * q[:, None] - np.sin(_ANGLES)
        w = np.where(np.abs(sine) < 1, np.cos(_ANGLES) + np.sqrt(np.maximum(1 - sine**2, 0)), 0.0)
        total += weight * np.average((np.pi * w / lam) ** 2, axis=1, weights=np.cos(_ANGLES))
    return total
