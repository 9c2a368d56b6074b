# SPDX-License-Identifier: GPL-3.0-or-later
"""The surfaces of docs/evaluation.md: the thesis's scans where they are, sample surfaces in their place where not."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from precompute.methods.flss import Taylor
from precompute.methods.method import Settings
from precompute.methods.windowed_images import WindowedImages, windowed
from precompute.surface.height_map import HeightMap
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import Relief, prepare
from precompute.surface.samples.ruled_gratings import blazed

from ..speed.surfaces import SKINS, skin
from .evaluation_maps import COHERENCES_UM


def height_maps(shared: Path) -> dict[str, HeightMap]:
    """The surfaces by name; "elaphe" and "xenopeltis" are the scans where the folder has them.

    The blazes of few periods are the same endless surface cut into a smaller patch. They are for short coherence
    lengths, because FLSS reads only a few texels around a frequency."""
    surfaces = {"blaze": read_height_map("sample:blazed"), **{name: skin(shared, name) for name in SKINS}}
    for um in COHERENCES_UM:
        periods = max(1, round(um / 2.5))
        surfaces[f"blaze of {periods}"] = blazed(periods=periods, rows=32 * periods)
    return surfaces


def reliefs(surfaces: dict[str, HeightMap]) -> dict[str, Relief]:
    """A relief for each surface, and another one for each skin, cut as the thesis cuts it ("elaphe, cut")."""
    prepared = {name: prepare(surface) for name, surface in surfaces.items()}
    return prepared | {f"{name}, cut": as_the_thesis_cuts(surfaces[name]) for name in SKINS}


def as_the_thesis_cuts(height_map: HeightMap) -> Relief:
    """The heights as they were measured, counted from their mean: no levelling and no apodisation. The coherence window
    is centred on the patch's corner, where its edges meet.

    The thesis does not tell this; its pictures and its table do (docs/evaluation.md)."""
    raw = prepare(replace(height_map, periodic=True))
    middle = tuple(n // 2 for n in raw.height_m.shape)
    return replace(raw, periodic=height_map.periodic, height_m=np.roll(raw.height_m, middle, (0, 1)))


def flss_about_mean(relief: Relief, settings: Settings) -> WindowedImages:
    """FLSS with settings.terms terms of Taylor's series about the relief's mean height, which is its zero."""
    expansion = Taylor(settings.terms, 0.0, float(np.abs(relief.height_m).max()))
    return windowed("flss", relief, expansion, settings=settings)
