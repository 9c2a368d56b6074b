# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of its grating a step has taken out of a scan."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..height_map import HeightMap
from ..holes import fill_missing
from ..levelling import level_plane
from ..periods import Wave, waves_of
from .step import Done

# A loss of this share of the strongest wave's light is seen side by side, and more is a warning; so is the loss of half
# of a fainter wave.
_SEEN = 0.05
_HALF = 0.5


def told_loss(before: HeightMap, after: HeightMap, told: str = "") -> Done:
    """The heights `after` a step, and how much it weakens the peaks of the grating's spectrum.

    Both maps have the same pixels. `told` is what else there is to tell of the step."""
    level = level_plane(before)
    gratings = waves_of(level).gratings
    kept = kept_shares(level, level_plane(after), gratings)
    weakens = loss_in_words([(wave, 1 - share) for wave, share in zip(gratings, kept, strict=True)])
    if not weakens:
        return Done(after, told)
    weakens += "; leave this step out to keep the colours"
    return Done(after, f"{told}; {weakens}" if told else weakens, warns=True)


def kept_shares(before: HeightMap, after: HeightMap, waves: Sequence[Wave]) -> list[float]:
    """The share of each wave's power that levelled heights still have after a step; both maps have the same pixels."""
    # Filled as for a bake.
    heights = [fill_missing(each).height_m for each in (before, after)] if waves else []
    powers = [[_power(height, before.pixel_size_m, wave) for height in heights] for wave in waves]
    return [last / first if first else 1.0 for first, last in powers]


def loss_in_words(losses: Sequence[tuple[Wave, float]]) -> str:
    """Which waves lose light that is seen, by their shares of power that are lost, the strongest wave first; "" where
    none does."""
    seen = [(wave, loss) for wave, loss in losses if loss >= min(_HALF, _SEEN * losses[0][0].light / wave.light)]
    main = f"the main peak of the grating ({losses[0][0].in_words()}) by {losses[0][1]:.0%}" if losses else ""
    fainter = [f"{wave.in_words()} by {loss:.0%}" for wave, loss in seen if wave is not losses[0][0]]
    parts = [main] if len(fainter) < len(seen) else []
    if fainter:
        parts.append(f"fainter waves of the grating ({', '.join(fainter)})")
    return f"weakens {' and '.join(parts)}" if parts else ""


def _power(height: np.ndarray, pixel_size_m: tuple[float, float], wave: Wave) -> float:
    """The power of a wave in levelled heights (rows, cols) under a Hann window."""
    rows, cols = height.shape
    dy, dx = pixel_size_m
    angle = math.radians(wave.angle_deg)
    # The row index runs along -B.
    along_y = _transformed(rows, -math.sin(angle) * dy / wave.period_m)
    along_x = _transformed(cols, math.cos(angle) * dx / wave.period_m)
    return abs(along_y @ (height @ along_x)) ** 2


def _transformed(count: int, cycles: float) -> np.ndarray:
    """A Hann window (count,) times the conjugate of a wave of so many cycles a pixel."""
    index = np.arange(count)
    return np.sin(np.pi * (index + 0.5) / count) ** 2 * np.exp(-2j * np.pi * cycles * index)
