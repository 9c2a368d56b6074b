# SPDX-License-Identifier: GPL-3.0-or-later
"""Made-up scans, and steps given as text."""

import numpy as np
import pytest

from precompute.surface.height_map import HeightMap
from precompute.surface.steps.pipeline import level, parse_steps


def wave(shape=(128, 128), pixel=(50e-9, 50e-9), *, period=800e-9, angle_deg=0.0, amplitude=50e-9):
    """A sine whose grating vector points angle_deg from T towards B; rows run along -B."""
    y, x = -np.arange(shape[0])[:, None] * pixel[0], np.arange(shape[1]) * pixel[1]
    angle = np.radians(angle_deg)
    return amplitude * np.sin(2 * np.pi * (x * np.cos(angle) + y * np.sin(angle)) / period + 0.4)


@pytest.fixture
def levelled():
    """A function that applies steps to heights (rows, cols) and returns new heights, height map and messages."""

    def carry_out(height, steps, *, pixel=(50e-9, 50e-9), periodic=False):
        done = level(HeightMap(height, pixel, "scan", periodic=periodic), parse_steps(steps))
        return done.height_map.height_m, done.height_map, done.told

    return carry_out
