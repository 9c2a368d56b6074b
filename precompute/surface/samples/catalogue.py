# SPDX-License-Identifier: GPL-3.0-or-later
"""Catalogue of the synthetic surfaces, which "sample:NAME" names wherever a file can be named.

Each is a HeightMap with periodic=True and a whole number of periods along each axis. Its grating vector points along
the tangent T, unless the surface's docstring says otherwise."""

from __future__ import annotations

from collections.abc import Callable

from ...base.failure import GratingError
from ..height_map import SAMPLE_PREFIX, HeightMap
from .discs import bluray, cd, dvd
from .reptiles import elaphe, xenopeltis
from .ruled_gratings import binary, blazed, flat, sinusoidal

SAMPLES: dict[str, Callable[[], HeightMap]] = {
    make.__name__: make for make in (flat, sinusoidal, binary, blazed, elaphe, xenopeltis, cd, dvd, bluray)
}

# Titles that are more than the name with a capital.
_TITLES = {"cd": "CD", "dvd": "DVD", "bluray": "Blu-ray"}

# Discs are of aluminium under polycarbonate.
_METALLISED = tuple(f"{SAMPLE_PREFIX}{name}" for name in ("cd", "dvd", "bluray"))


def matter_of(source: str) -> str:
    """Return what the surface that a source names is made of, as --matter takes it: a disc is of aluminium under
    polycarbonate."""
    return "plate 1.585, aluminium" if source in _METALLISED else "dielectric"


def title_of(name: str) -> str:
    """Return a sample's name as people write it."""
    return _TITLES.get(name, name.capitalize())


def make_sample(name: str) -> HeightMap:
    """Make the surface of a name in SAMPLES. Raises GratingError for an unknown name."""
    if name not in SAMPLES:
        raise GratingError(f"{SAMPLE_PREFIX}{name}", "there is no such sample", f"choose one of {', '.join(SAMPLES)}")
    return SAMPLES[name]()
