# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how much a step weakens the grating of a scan."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..height_map import HeightMap
from ..height_spectrum import amplitude_at
from ..holes import fill_missing
from ..least_squares_plane import level_plane
from ..periods import Wave, waves_of
from .step import Done

# The least visible loss, as a share of the strongest wave's light. Losing half of a fainter wave gives a warning too.
_SEEN = 0.05
_HALF = 0.5


def told_loss(before: HeightMap, after: HeightMap, told: str = "", *, holes: float = 0.0) -> Done:
    """Return the heights `after` a step, with a warning if the step weakens the grating.

    Both maps have the same pixels. `told` is another message; `holes` is the share of the scan turned into holes."""
    level = level_plane(before)
    weakens = loss_in_words(losses_of(level, level_plane(after), waves_of(level).gratings), holes)
    if not weakens:
        return Done(after, told)
    weakens += "; leave this step out to keep the colours"
    return Done(after, f"{told}; {weakens}" if told else weakens, warns=True)


def losses_of(before: HeightMap, after: HeightMap, waves: Sequence[Wave]) -> list[tuple[Wave, float]]:
    """Measure the share of each wave's power that a step removes from levelled heights; both maps have equal pixels."""
    # Filled as for a bake.
    heights = [fill_missing(each).height_m for each in (before, after)] if waves else []
    powers = [[_power(height, before.size_m, wave) for height in heights] for wave in waves]
    return [(wave, 1 - last / first if first else 0.0) for wave, (first, last) in zip(waves, powers, strict=True)]


def loss_in_words(losses: Sequence[tuple[Wave, float]], holes: float = 0.0) -> str:
    """Describe the waves, given strongest first, with a visible loss of light; "" if there are none."""
    seen = [
        (wave, loss)
        for wave, loss in losses
        if _beyond(wave, loss, holes) >= min(_HALF, _SEEN * losses[0][0].light / wave.light)
    ]
    main = [f"the main peak of the grating ({wave.in_words()}) by {loss:.0%}" for wave, loss in seen[:1]
            if wave is losses[0][0]]  # fmt: skip
    fainter = ", ".join(f"{wave.in_words()} by {loss:.0%}" for wave, loss in seen[len(main) :])
    parts = [*main, *([f"fainter waves of the grating ({fainter})"] if fainter else [])]
    return f"weakens {' and '.join(parts)}" if parts else ""


def _beyond(wave: Wave, loss: float, holes: float) -> float:
    """Return the share of a wave's power lost beyond what holes anywhere in the scan would take.

    Holes are filled smoothly, so they take their share of the amplitude. Their former content, such as dust, adds as
    much amplitude to the peak as to the waves around it, and its removal changes the power by twice that share."""
    return 1 - (1 - loss) / (1 - holes) ** 2 - 2 / math.sqrt(wave.contrast) if holes else loss


def _power(height: np.ndarray, size_m: tuple[float, float], wave: Wave) -> float:
    """Return the power of a wave in levelled heights (rows, cols) of sides size_m (Ly, Lx), under a Hann window."""
    angle = math.radians(wave.angle_deg)
    # The row index runs along -B.
    cycles = -math.sin(angle) * size_m[0] / wave.period_m, math.cos(angle) * size_m[1] / wave.period_m
    return abs(amplitude_at(height, cycles)) ** 2
