# SPDX-License-Identifier: GPL-3.0-or-later
"""The mean spectrum of a surface that lies in many directions: its power averaged over turns about q = 0.

A turned surface has the turned spectrum, so the mean over turns is a blur along rings. The rings are sampled as finely
as the bins, by cubic convolution. The blur is a product of transforms along each ring."""

import math

import numpy as np

from ..surface.cubic_convolution import read_between
from .spectrum import FrequencyGrid

_ROWS_AT_ONCE = 128


def over_turns(power: np.ndarray, grid: FrequencyGrid, radians: float) -> np.ndarray:
    """The mean of the power (ny, nx) on a grid's bins over normally distributed turns of standard deviation `radians`.

    The sum and the kind of float stay. Bins beyond the largest ring on the grid stay, too."""
    sides = grid.q_y, grid.q_x
    step = min(float(q[1] - q[0]) for q in sides)
    reach = min(float(-q[0]) for q in sides)
    radii = np.arange(int(reach / step) + 1) * step
    angles = np.linspace(0, 2 * np.pi, math.ceil(2 * np.pi * len(radii)), endpoint=False)
    fall = np.exp(-0.5 * (np.arange(len(angles) // 2 + 1) * radians) ** 2).astype(np.float32)
    rings = np.empty((len(radii), len(angles)), np.float32)
    for part in _parts(len(radii)):
        turned = (radii[part, None] * wave for wave in (np.sin(angles), np.cos(angles)))
        sampled = read_between(power, *((at - q[0]) / (q[1] - q[0]) for at, q in zip(turned, sides, strict=True)))
        rings[part] = np.fft.irfft(np.fft.rfft(sampled, axis=1) * fall, len(angles), axis=1)
    # A ring closes: cubic convolution reads one column to the left, and two to the right.
    rings = np.concatenate([rings[:, -1:], rings, rings[:, :2]], axis=1)
    out = power.copy()
    for part in _parts(len(power)):
        y, x = grid.q_y[part, None], grid.q_x
        ring, angle = np.hypot(y, x) / step, np.arctan2(y, x) % (2 * np.pi)
        blurred = read_between(rings, ring, 1 + angle * (len(angles) / (2 * np.pi)))
        out[part] = np.where(ring <= len(radii) - 1, np.maximum(blurred, 0), out[part])
    total = out.sum(dtype=float)
    return out * power.dtype.type(power.sum(dtype=float) / total) if total > 0 else out


def _parts(count: int) -> list[slice]:
    return [slice(start, start + _ROWS_AT_ONCE) for start in range(0, count, _ROWS_AT_ONCE)]
