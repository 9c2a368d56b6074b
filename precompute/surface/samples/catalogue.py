# SPDX-License-Identifier: GPL-3.0-or-later
"""Synthetic surfaces, usable as "sample:NAME" wherever a file is: exact, seeded, and wrapping at the edges.

All are HeightMap with periodic=True and a whole number of periods along each axis. Heights vary along the
columns (the tangent T) unless a surface says otherwise, so that T is the direction of the grating vector.
"""

from __future__ import annotations

from collections.abc import Callable

from ...base.failure import GratingError
from ..height_map import HeightMap
from .discs import bluray, cd, dvd
from .gratings import binary, blazed, flat, sinusoidal
from .skins import elaphe, xenopeltis

SAMPLES: dict[str, Callable[[], HeightMap]] = {
    make.__name__: make for make in (flat, sinusoidal, binary, blazed, elaphe, xenopeltis, cd, dvd, bluray)
}


def make_sample(name: str) -> HeightMap:
    """The surface of that name, always the same one. Raises GratingError where there is none."""
    if name not in SAMPLES:
        raise GratingError(f"sample:{name}: there is no such sample; choose one of {', '.join(SAMPLES)}")
    return SAMPLES[name]()
