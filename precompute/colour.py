# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra to XYZ, XYZ to a scene's linear RGB, and colour differences.

A flat mirror under the chosen illuminant is exactly white: the weights of every channel are normalised so that
their Y sums to 1. Tables: CIE 1931 2 degree observer, D65 (see the head of cie_1931_d65_1nm.csv).
"""

from functools import cache
from pathlib import Path

import numpy as np

WAVELENGTH_MIN_M = 380e-9
WAVELENGTH_MAX_M = 780e-9
ILLUMINANTS = ("D65", "E")

# xy chromaticities of the primaries and the white, ITU-R BT.709, BT.2020 and SMPTE ST 2065 / AP1.
_D65_XY = (0.3127, 0.3290)
_ACES_XY = (0.32168, 0.33767)
RGB_SPACES = {
    "Rec.709": (((0.64, 0.33), (0.30, 0.60), (0.15, 0.06)), _D65_XY),
    "Rec.2020": (((0.708, 0.292), (0.170, 0.797), (0.131, 0.046)), _D65_XY),
    "ACEScg": (((0.713, 0.293), (0.165, 0.830), (0.128, 0.044)), _ACES_XY),
}
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


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


def _xyz_of_xy(xy: tuple[float, float]) -> np.ndarray:
    x, y = xy
    return np.array([x / y, 1.0, (1 - x - y) / y])


def rgb_from_xyz(space: str = "Rec.709", illuminant: str = "D65") -> np.ndarray:
    """Matrix (3, 3) from XYZ under the illuminant to the space's linear RGB; a perfect mirror becomes (1, 1, 1).

    The illuminant's white is moved to the space's own white by the Bradford transform (Lindbloom)."""
    primaries_xy, white_xy = RGB_SPACES[space]
    space_white = _xyz_of_xy(white_xy)
    primaries = np.stack([_xyz_of_xy(xy) for xy in primaries_xy], axis=1)
    to_xyz = primaries * np.linalg.solve(primaries, space_white)
    cones = (_BRADFORD @ space_white) / (_BRADFORD @ white_xyz(illuminant))
    adapt = np.linalg.solve(_BRADFORD, cones[:, None] * _BRADFORD)
    return np.linalg.solve(to_xyz, adapt)


def srgb_encode(linear: np.ndarray) -> np.ndarray:
    """Linear Rec.709 to sRGB code values in 0..1 (IEC 61966-2-1), clipped to the displayable range."""
    x = np.clip(linear, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def lab(xyz: np.ndarray, white: np.ndarray) -> np.ndarray:
    """CIE 1976 L*a*b* (..., 3) of XYZ (..., 3) against a white (3,)."""
    t = xyz / white
    eps, kappa = 216 / 24389, 24389 / 27
    f = np.where(t > eps, np.cbrt(t), (kappa * t + 16) / 116)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], -1)


def delta_e_2000(lab_1: np.ndarray, lab_2: np.ndarray) -> np.ndarray:
    """CIEDE2000 colour difference (...,) of L*a*b* (..., 3) (Sharma, Wu and Dalal 2005, eqs 2 to 22)."""
    l1, a1, b1 = np.moveaxis(np.asarray(lab_1, float), -1, 0)
    l2, a2, b2 = np.moveaxis(np.asarray(lab_2, float), -1, 0)
    c_mean7 = (0.5 * (np.hypot(a1, b1) + np.hypot(a2, b2))) ** 7
    g = 1.5 - 0.5 * np.sqrt(c_mean7 / (c_mean7 + 25.0**7))
    c1, c2 = np.hypot(a1 * g, b1), np.hypot(a2 * g, b2)
    h1, h2 = np.arctan2(b1, a1 * g) % (2 * np.pi), np.arctan2(b2, a2 * g) % (2 * np.pi)
    grey = c1 * c2 == 0
    turn = np.where(grey, 0, (h2 - h1 + np.pi) % (2 * np.pi) - np.pi)
    dl, dc, dh = l2 - l1, c2 - c1, 2 * np.sqrt(c1 * c2) * np.sin(turn / 2)
    l_mean, c_mean = 0.5 * (l1 + l2), 0.5 * (c1 + c2)
    h_mean = np.where(grey, h1 + h2, h1 + turn / 2)
    t = (
        1
        - 0.17 * np.cos(h_mean - np.radians(30))
        + 0.24 * np.cos(2 * h_mean)
        + 0.32 * np.cos(3 * h_mean + np.radians(6))
        - 0.20 * np.cos(4 * h_mean - np.radians(63))
    )
    bell = np.exp(-((((np.degrees(h_mean) % 360) - 275) / 25) ** 2))
    rotation = -2 * np.sqrt(c_mean**7 / (c_mean**7 + 25.0**7)) * np.sin(np.radians(60) * bell)
    dl /= 1 + 0.015 * (l_mean - 50) ** 2 / np.sqrt(20 + (l_mean - 50) ** 2)
    dc /= 1 + 0.045 * c_mean
    dh /= 1 + 0.015 * c_mean * t
    return np.sqrt(np.maximum(dl**2 + dc**2 + dh**2 + rotation * dc * dh, 0))
