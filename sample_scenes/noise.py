# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth random fields in NumPy, from which sets take their shapes. A seed gives the same field everywhere."""

from __future__ import annotations

from itertools import product

import numpy as np

_PRIMES = (0x8DA6B343, 0xD8163841, 0xCB1AB31F)


def value_noise(points: np.ndarray, seed: int = 0) -> np.ndarray:
    """Smooth values (...) in [-1, 1] at points (..., d), d at most 3. Values are independent at distances above 1."""
    cell = np.floor(points).astype(np.int64)
    part = points - cell
    part = part**3 * (part * (6 * part - 15) + 10)
    value = np.zeros(points.shape[:-1])
    for corner in product((0, 1), repeat=points.shape[-1]):
        weight = np.prod(np.where(corner, part, 1 - part), axis=-1)
        value += weight * _lattice(cell + corner, seed)
    return value


def fractal_noise(points: np.ndarray, octaves: int, seed: int = 0) -> np.ndarray:
    """A sum of `octaves` noises, each half as high and half as wide as the one before; within [-1, 1]."""
    heights = 0.5 ** np.arange(octaves)
    noises = (h * value_noise(points * 2**k, seed + k) for k, h in enumerate(heights))
    return sum(noises) / heights.sum()


def cracks(points: np.ndarray, width: float, seed: int = 0) -> np.ndarray:
    """Grooves where a noise is 0: 1 at their bottom, 0 where the noise exceeds `width`."""
    return np.clip(1 - np.abs(value_noise(points, seed)) / width, 0, 1)


def _lattice(cell: np.ndarray, seed: int) -> np.ndarray:
    """A fixed pseudo-random number in [-1, 1) for each whole-numbered point (..., d)."""
    mixed = np.full(cell.shape[:-1], (seed * 0x9E3779B1) & 0xFFFFFFFF, np.uint64)
    for axis in range(cell.shape[-1]):
        mixed ^= (cell[..., axis].astype(np.uint64) * np.uint64(_PRIMES[axis])) & np.uint64(0xFFFFFFFF)
        mixed = (mixed * np.uint64(0x2C1B3C6D)) & np.uint64(0xFFFFFFFF)
        mixed ^= mixed >> np.uint64(15)
    mixed = (mixed * np.uint64(0x297A2D39)) & np.uint64(0xFFFFFFFF)
    return (mixed ^ (mixed >> np.uint64(15))).astype(float) / 2**31 - 1
