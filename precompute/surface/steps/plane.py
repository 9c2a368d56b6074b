# SPDX-License-Identifier: GPL-3.0-or-later
"""Taking out a plane, and a polynomial background."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..height_map import HeightMap
from ..least_squares_plane import fitted_plane, level_plane
from .loss import told_loss
from .step import Done

# A height this many standard deviations from the plane is dust: of a normal distribution, 1 in 370 is.
_CLIPPED_SIGMAS = 3.0
# The standard deviation of a normal distribution, in medians of its absolute values.
SIGMA_OF_MAD = 1.4826
# Fits settle in a few rounds.
_ROUNDS_MAX = 20


def plane(height_map: HeightMap, fit: str) -> Done:
    """Subtract a plane: by `fit` "least-squares" the one through all heights, by "robust" the one through those that
    are no dust. A periodic surface has no tilt and keeps its heights."""
    if height_map.periodic:
        return Done(height_map)
    return Done(level_plane(height_map) if fit == "least-squares" else _level_robust(height_map))


def _level_robust(height_map: HeightMap) -> HeightMap:
    """Fit the plane, leave out what stands off it by more than three robust standard deviations, and fit again until
    no other heights are left out."""
    height = height_map.height_m
    kept = np.isfinite(height)
    for _ in range(_ROUNDS_MAX):
        level = height - sum(fitted_plane(np.where(kept, height, np.nan)))
        level -= np.nanmedian(level)
        off = np.abs(level)
        # Where more than half of the heights lie in one plane exactly, all that are not in it would be dust.
        now = off <= _CLIPPED_SIGMAS * SIGMA_OF_MAD * np.nanmedian(off)
        if not now.any() or (now == kept).all():
            break
        kept = now
    return replace(height_map, height_m=height - sum(fitted_plane(np.where(kept, height, np.nan))))


def background(height_map: HeightMap, degree: float) -> Done:
    """Subtract the least-squares polynomial of x and y of a total degree, 1 to 5.

    The normal equations are of products of Legendre polynomials, which are nearly orthogonal on the scan."""
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
