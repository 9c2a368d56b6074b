# SPDX-License-Identifier: GPL-3.0-or-later
"""Perceived colour differences: CIE L*a*b* and CIEDE2000."""

import numpy as np


def lab(xyz: np.ndarray, white: np.ndarray) -> np.ndarray:
    """Convert XYZ (..., 3) to CIE 1976 L*a*b* (..., 3), relative to a white's XYZ (3,)."""
    t = xyz / white
    eps, kappa = 216 / 24389, 24389 / 27
    f = np.where(t > eps, np.cbrt(t), (kappa * t + 16) / 116)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], -1)


def delta_e_2000(lab_1: np.ndarray, lab_2: np.ndarray) -> np.ndarray:
    """CIEDE2000 differences (...,) of L*a*b* colours (..., 3) (Sharma, Wu and Dalal 2005, equations 2 to 22)."""
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
