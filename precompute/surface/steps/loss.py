# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of its grating a step has taken out of a scan."""

from __future__ import annotations

import math

import numpy as np

from ..height_map import HeightMap
from ..holes import fill_missing
from ..levelling import level_plane
from ..periods import Wave, waves_of
from .step import Done

# A loss of light of this share is seen side by side, and more is a warning.
_SEEN = 0.05


def told_loss(before: HeightMap, after: HeightMap, told: str = "") -> Done:
    """The heights `after` a step, and how much it weakens the main peak of the grating's spectrum.

    Both maps have the same pixels. `told` is what else there is to tell of the step."""
    level = level_plane(before)
    gratings = waves_of(level).gratings
    if not gratings:
        return Done(after, told)
    main = gratings[0]
    powers = [_power(each, main) for each in (level, level_plane(after))]
    loss = 1 - powers[1] / powers[0]
    if loss < _SEEN:
        return Done(after, told)
    weakens = f"weakens the main peak of the grating ({main.in_words()}) by {loss:.0%}"
    return Done(after, f"{told}; {weakens}" if told else weakens, warns=True)


def _power(level: HeightMap, wave: Wave) -> float:
    """The power of a wave in levelled heights under a Hann window, with holes filled as for a bake."""
    rows, cols = level.height_m.shape
    dy, dx = level.pixel_size_m
    angle = math.radians(wave.angle_deg)
    # The row index runs along -B.
    along_y = _transformed(rows, -math.sin(angle) * dy / wave.period_m)
    along_x = _transformed(cols, math.cos(angle) * dx / wave.period_m)
    return abs(along_y @ (fill_missing(level).height_m @ along_x)) ** 2


def _transformed(count: int, cycles: float) -> np.ndarray:
    """A Hann window (count,) times the conjugate of a wave of so many cycles a pixel."""
    index = np.arange(count)
    return np.sin(np.pi * (index + 0.5) / count) ** 2 * np.exp(-2j * np.pi * cycles * index)
