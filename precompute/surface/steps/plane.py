# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps that subtract a plane or a polynomial background."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..height_map import HeightMap
from ..least_squares_plane import fitted_plane, level_plane
from .loss import told_loss
from .step import Done

# Heights this many standard deviations off the plane are dust: in a normal distribution 1 in 370.
_CLIPPED_SIGMAS = 3.0
# The ratio of a normal distribution's standard deviation to the median of its absolute values.
SIGMA_OF_MAD = 1.4826
# Fits converge in a few rounds.
_ROUNDS_MAX = 20


def plane(height_map: HeightMap, fit: str) -> Done:
    """Subtract the plane through all heights (`fit` "least-squares"), or through the heights without dust ("robust").
    A periodic surface has no tilt and keeps its heights."""
    if height_map.periodic:
        return Done(height_map)
    return Done(level_plane(height_map) if fit == "least-squares" else _level_robust(height_map))


def _level_robust(height_map: HeightMap) -> HeightMap:
    """Fit a plane, exclude heights over three robust standard deviations off it, and repeat until nothing changes."""
    height = height_map.height_m
    kept = np.isfinite(height)
    for _ in range(_ROUNDS_MAX):
        level = height - sum(fitted_plane(np.where(kept, height, np.nan)))
        level -= np.nanmedian(level)
        off = np.abs(level)
        # If more than half of the heights lie exactly in one plane, all others count as dust.
        now = off <= _CLIPPED_SIGMAS * SIGMA_OF_MAD * np.nanmedian(off)
        if not now.any() or (now == kept).all():
            break
        kept = now
    return replace(height_map, height_m=height - sum(fitted_plane(np.where(kept, height, np.nan))))


def background(height_map: HeightMap, degree: float) -> Done:
    """Subtract the least-squares polynomial of x and y of a total degree from 1 to 5.

    The basis is products of Legendre polynomials, which are nearly orthogonal on the scan."""
    height = height_map.height_m
    powers = int(degree) + 1
    y, x = (
        np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, n) if n > 1 else np.zeros(1), powers - 1)
        for n in height.shape
    )
    finite = np.isfinite(height)
    used = np.add.outer(np.arange(powers), np.arange(powers)) < powers
    pairs = (finite @ (x[:, :, None] * x[:, None, :]).reshape(len(x), -1)).reshape(-1, powers, powers)
    normal = np.einsum("yi,yk,yjl->ijkl", y, y, pairs)[used][:, used]
    moment = (y.T @ (np.where(finite, height, 0.0) @ x))[used]
    coefficients = np.zeros((powers, powers))
    coefficients[used] = np.linalg.lstsq(normal, moment, rcond=None)[0]
    level = replace(height_map, height_m=height - y @ coefficients @ x.T, periodic=False)
    return told_loss(height_map, level)
