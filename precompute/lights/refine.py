# SPDX-License-Identifier: GPL-3.0-or-later
"""Sources finer than a panorama's pixels, by closer looks at the world."""

from collections.abc import Callable, Sequence

import numpy as np

from .panorama import Cells, crop_cells, inside_crop, panorama_cells
from .sources import LEAST_SHARE, Source, fit_sources, lit, owners, refit

# A closer look at the world: of a direction (3,), an angle and a size, the radiance (size, size, 3) of the cells
# crop_cells(size, angle, direction).
Look = Callable[[np.ndarray, float, int], np.ndarray]
# A source with a narrower cone, in radians, is looked at. No piece of a divided source is so narrow.
_NARROW = 0.058
# It is looked at again until its cone has so many pixels on each side, and holds its light to about 1 %.
_RESOLVED_PIXELS = 6
# A closer look is this many pixels wide, and so many radii of the cone on each side: the surroundings are read from
# within 1.73 radii.
LOOK_SIZE, _LOOK_RADII = 64, 3
# Each look is some ten times finer than the one before: the third finds a disc of 0.001 degrees.
_LOOKS = 3


def fit_closely(radiance: np.ndarray, count: int, look: Look, *, suns: Sequence[np.ndarray] = ()) -> list[Source]:
    """fit_sources of a panorama (rows, cols, 3), with each small source fitted again in closer looks at it.

    `suns` are directions (3,) that are looked at in any case: a sun may be so small that no sample of the panorama met
    it."""
    cells, flat = panorama_cells(*radiance.shape[:2]), np.asarray(radiance, float).reshape(-1, 3)
    pixel = np.pi / radiance.shape[0]
    found = fit_sources(radiance, count)
    hinted = [Source(np.array(sun, float), np.zeros(3), pixel**2 / 12) for sun in suns]
    hinted = [sun for sun in hinted if owners(found, sun.direction[None])[0] < 0]
    fitted = []
    for source in (*found, *hinted):
        for _ in range(_LOOKS if source.cone_radius < _NARROW else 0):
            half_angle = _LOOK_RADII * source.cone_radius
            seen = look(source.direction, half_angle, LOOK_SIZE).reshape(-1, 3)
            crop = crop_cells(LOOK_SIZE, half_angle, source.direction)
            outside = ~inside_crop(cells.directions, half_angle, source.direction)
            cells, flat = _together(cells[outside], crop), np.concatenate((flat[outside], seen))
            source = refit(source, seen, crop)
            if source.cone_radius >= _RESOLVED_PIXELS * 2 * half_angle / LOOK_SIZE:
                break
        if not any(_is_same(source, other) for other in fitted):
            fitted.append(source)
    lights = lit(fitted, flat, cells)
    least = LEAST_SHARE * float(np.sum(flat * cells.solid_angles[:, None]))
    return [source for source in lights if source.irradiance.sum() >= least][:count]


def _is_same(one: Source, other: Source) -> bool:
    """Whether two sources became one in a closer look: each lies in the other's cone, and they are about as wide."""
    narrow, wide = sorted((one, other), key=lambda source: source.variance)
    return owners([narrow], wide.direction[None])[0] == 0 and wide.variance < 4 * narrow.variance


def _together(one: Cells, other: Cells) -> Cells:
    return Cells(*(np.concatenate((getattr(one, name), getattr(other, name))) for name in one.__dataclass_fields__))
