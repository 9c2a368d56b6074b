# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that resemble the shed skins of two snakes: rows of small fingers on uneven ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..height_map import HeightMap
from .ruled_gratings import wrapping_blur, wrapping_noise, wrapping_surface


def elaphe() -> HeightMap:
    """Shed skin of Elaphe guttata: rows of long fingers 1144 nm apart along T, 375 nm from peak to peak.

    Its irregularities are random, with the strengths measured on a real skin: about 25 nm rms in the first order,
    fingers 3.1 um long, slow waves of 20 nm rms, and some grains of dust."""
    return _skin(
        "elaphe",
        _Skin(
            seed=1144,
            side_m=57 * 1144e-9,
            fingers=(21, 57),
            relief_m=375e-9,
            finger_m=80e-9,
            rise_m=16e-9,
            floor_m=-52e-9,
            tip_width=0.17,
            base_width=0.66,
            stagger=0.13,
            drift=(0.4, 0.5),
            uneven=0.15,
            waves_m=(16e-9, 13e-9),
            grains=14,
            grain_m=260e-9,
        ),
    )


def xenopeltis() -> HeightMap:
    """Shed skin of Xenopeltis unicolor: short, dense fingers in straight rows 1552 nm apart, 818.69 nm peak to peak.

    The rows have the strongest period, so the grating vector points along B, the direction of the fingers."""
    return _skin(
        "xenopeltis",
        _Skin(
            seed=1552,
            side_m=42 * 1552e-9,
            fingers=(42, 116),
            relief_m=818.69e-9,
            finger_m=95e-9,
            rise_m=60e-9,
            floor_m=200e-9,
            tip_width=0.25,
            base_width=0.62,
            stagger=0.05,
            drift=(0.1, 0.7),
            uneven=0.15,
            waves_m=(60e-9, 25e-9),
            grains=0,
            grain_m=0.0,
        ),
    )


@dataclass(frozen=True)
class _Skin:
    """The dimensions of a skin; a pitch is the mean distance of neighbouring fingers in a row, or of rows."""

    seed: int
    side_m: float
    fingers: tuple[int, int]  # number of rows, number of fingers in a row
    relief_m: float  # of the whole surface, from peak to peak
    finger_m: float  # height of a finger's ridge over the floor beside its tip
    rise_m: float  # of the ridge from tip to base
    floor_m: float  # rise of the floor from tip to base
    tip_width: float  # half width of a finger at its tip, in pitches
    base_width: float  # half width of a finger at its base, in pitches
    stagger: float  # rms shift of a finger's ends against its neighbours' ends, in pitches
    drift: tuple[float, float]  # rms deviation of the rows and of the fingers from straight lines, in pitches
    uneven: float  # rms deviation of the fingers' relative heights from 1
    waves_m: tuple[float, float]  # rms of the ground's long and short waves
    grains: int  # number of grains of dust
    grain_m: float  # height of the highest grain


def _skin(name: str, skin: _Skin) -> HeightMap:
    """Make rows of fingers that point to the top of the scan, on uneven ground; 800 x 800 pixels.

    A finger widens from a narrow tip, at the base of the row above, to its own base, where it meets its neighbours. The
    floor beside it rises or sinks on the way. Both end in a step where the next row begins."""
    rng = np.random.default_rng(skin.seed)
    shape = (800, 800)
    y, x = np.arange(shape[0])[:, None] / shape[0], np.arange(shape[1]) / shape[1]
    lane = skin.fingers[1] * x + skin.drift[1] * wrapping_noise(rng, shape, (0.30, 0.06))
    row = (
        skin.fingers[0] * y
        + skin.drift[0] * wrapping_noise(rng, shape, (0.20, 0.08))
        + skin.stagger * wrapping_noise(rng, shape, (0.05, 0.5 / skin.fingers[1]))
    )
    along = row % 1
    own = np.floor(row).astype(int) % skin.fingers[0], np.round(lane).astype(int) % skin.fingers[1]
    height = 1 + skin.uneven * rng.standard_normal(skin.fingers)[own]
    half_width = skin.tip_width + (skin.base_width - skin.tip_width) * along**1.5
    aside = np.minimum(np.abs(lane - np.round(lane)) / half_width, 1)
    ridge = (skin.finger_m + skin.rise_m * along) * height * np.cos(np.pi / 2 * aside) ** 2
    floor = skin.floor_m * along**2
    relief = (
        wrapping_blur(ridge + floor, 0.6)
        + skin.waves_m[0] * wrapping_noise(rng, shape, (0.14, 0.14))
        + skin.waves_m[1] * wrapping_noise(rng, shape, (0.04, 0.03))
        + _dust(rng, shape, count=skin.grains, height_m=skin.grain_m)
    )
    relief -= relief.min()
    return wrapping_surface(name, relief * (skin.relief_m / relief.max()), skin.side_m / shape[1])


def _dust(rng: np.random.Generator, shape: tuple[int, int], *, count: int, height_m: float) -> np.ndarray:
    """Scatter round grains a few pixels wide; the highest has the height height_m."""
    dust = np.zeros(shape)
    if count:
        places = rng.integers(shape[0], size=count), rng.integers(shape[1], size=count)
        dust[places] = rng.uniform(0.1, 1, count)
        dust = wrapping_blur(dust, 2.5)
        dust *= height_m / dust.max()
    return dust
