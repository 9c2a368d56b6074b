# SPDX-License-Identifier: GPL-3.0-or-later
"""The CIE 1931 observer under an illuminant: from spectra to XYZ.

A flat mirror under the chosen illuminant is exactly white: the weights of every channel are normalised so that
their Y sums to 1. Tables: CIE 1931 2 degree observer, D65 (see the head of cie_1931_d65_1nm.csv).
"""

from functools import cache
from pathlib import Path

import numpy as np

WAVELENGTH_MIN_M = 380e-9


WAVELENGTH_MAX_M = 780e-9


ILLUMINANTS = ("D65", "E")


@cache
def _cie_table() -> np.ndarray:
    return np.loadtxt(Path(__file__).with_name("cie_1931_d65_1nm.csv"), delimiter=",")


def observer(wavelengths_m: np.ndarray, illuminant: str = "D65") -> np.ndarray:
    """Colour matching functions times the illuminant's power at wavelengths (n,) in metres; (n, 3), zero outside
    380 to 780 nm, scaled so that the integral of the Y column over wavelength in metres is 1."""
    table = _cie_table()
    power = table[:, 4] if illuminant == "D65" else np.ones(len(table))
    weighted = table[:, 1:4] * power[:, None]
    weighted = weighted / (_trapezoid_weights(table[:, 0] * 1e-9) @ weighted[:, 1])
    nm = np.asarray(wavelengths_m) * 1e9
    return np.stack([np.interp(nm, table[:, 0], w, left=0, right=0) for w in weighted.T], axis=-1)


def spectral_weights(wavelengths_m: np.ndarray, illuminant: str = "D65") -> np.ndarray:
    """Weights (n, 3) with which a spectrum sampled at ascending wavelengths (n,) sums to XYZ (trapezoid rule).

    Each channel is scaled so that a constant spectrum of 1 sums to the illuminant's white exactly, whatever the
    step: a flat mirror is white at any resolution."""
    weights = observer(wavelengths_m, illuminant) * _trapezoid_weights(wavelengths_m)[:, None]
    return weights * (white_xyz(illuminant) / weights.sum(axis=0))


@cache
def _white(illuminant: str) -> tuple[float, ...]:
    nm = _cie_table()[:, 0] * 1e-9
    return tuple(_trapezoid_weights(nm) @ observer(nm, illuminant))


def white_xyz(illuminant: str = "D65") -> np.ndarray:
    """XYZ (3,) of the illuminant seen in a perfect mirror, Y = 1."""
    return np.array(_white(illuminant))


def _trapezoid_weights(x: np.ndarray) -> np.ndarray:
    x = np.asarray(x, dtype=float)
    if len(x) == 1:
        return np.ones(1)
    steps = np.diff(x)
    return 0.5 * (np.concatenate([[0], steps]) + np.concatenate([steps, [0]]))


# The largest s = w / lambda of any scene: light and view along the normal, at the shortest wavelength.
S_MAX = 2 / WAVELENGTH_MIN_M


def wavelengths(step_m: float = 1e-9) -> np.ndarray:
    """380 to 780 nm in steps of at most step_m, metres, ends included."""
    count = int(np.ceil((WAVELENGTH_MAX_M - WAVELENGTH_MIN_M) / step_m - 1e-6))
    return np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, count + 1)
