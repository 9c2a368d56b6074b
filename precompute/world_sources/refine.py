# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits sources finer than a panorama's pixels, by closer looks at the world."""

from collections.abc import Callable, Sequence

import numpy as np

from .panorama import Cells, crop_cells, inside_crop, panorama_cells
from .sources import LEAST_SHARE, Source, clean, fit_sources, lit, owners, refit

# A closer look at the world: takes a direction (3,), an angle and a size, and returns the radiance (size, size, 3) of
# crop_cells(size, angle, direction).
Look = Callable[[np.ndarray, float, int], np.ndarray]
# Sources with a narrower cone, in radians, get closer looks. No piece of a divided source is this narrow.
_NARROW = 0.058
# Looks repeat until the cone has this many pixels on each side, which fits its light to about 1 %.
_RESOLVED_PIXELS = 6
# The width of a look in pixels, and its half width in radii of the cone: the surroundings are read within 1.73 radii.
LOOK_SIZE, _LOOK_RADII = 64, 3
# Each look is about ten times finer than the one before: the third finds a disc of 0.001 degrees.
_LOOKS = 3


def fit_closely(radiance: np.ndarray, count: int, look: Look, *, suns: Sequence[np.ndarray] = ()) -> list[Source]:
    """Fit sources to a panorama (rows, cols, 3) like fit_sources, and fit each small source again in closer looks.

    `suns` are directions (3,) that always get a closer look, because the panorama may miss a small sun."""
    world = _World(radiance, look)
    found = fit_sources(radiance, count)
    narrow = [source for source in found if source.cone_radius < _NARROW]
    hinted = [Source(np.array(sun, float), np.zeros(3), (np.pi / radiance.shape[0]) ** 2 / 12) for sun in suns]
    fitted = [world.seen_closely(sun) for sun in hinted if owners(narrow, sun.direction[None])[0] < 0]
    fitted = [sun for sun in fitted if sun.irradiance.sum() >= world.least()]
    if fitted:
        found = fit_sources(radiance, count - len(fitted))
    for source in found:
        source = world.seen_closely(source)
        if not any(_is_same(source, other) for other in fitted):
            fitted.append(source)
    lights = lit(fitted, world.radiance, world.cells)
    # A source that is left out may lie in the cone of another, which then takes its light.
    counted = [source for source in lights if source.irradiance.sum() >= world.least()][: max(count, 0)]
    return lit(counted, world.radiance, world.cells)


class _World:
    """The cells of a world and their radiance (n, 3): from the panorama, and finer ones from closer looks."""

    def __init__(self, radiance: np.ndarray, look: Look) -> None:
        self.cells, self._look = panorama_cells(*radiance.shape[:2]), look
        self.radiance = clean(radiance)

    def least(self) -> float:
        """The least light of a part that is worth a source, summed over the colours."""
        return LEAST_SHARE * float(np.sum(self.radiance * self.cells.solid_angles[:, None]))

    def seen_closely(self, source: Source) -> Source:
        """Fit a narrow source again in closer looks; a wide source stays as it is."""
        for _ in range(_LOOKS if source.cone_radius < _NARROW else 0):
            half_angle = _LOOK_RADII * source.cone_radius
            crop = crop_cells(LOOK_SIZE, half_angle, source.direction)
            seen = clean(self._look(source.direction, half_angle, LOOK_SIZE))
            self._take(crop, seen, half_angle)
            source = refit(source, seen, crop)
            if source.cone_radius >= _RESOLVED_PIXELS * 2 * half_angle / LOOK_SIZE:
                break
        return source

    def _take(self, crop: Cells, seen: np.ndarray, half_angle: float) -> None:
        left = _uncovered(self.cells, crop, half_angle)
        kept, old = left > 0, self.cells
        rest = left[kept]
        self.cells = Cells(
            np.concatenate((old.directions[kept], crop.directions)),
            np.concatenate((old.solid_angles[kept] * rest, crop.solid_angles)),
            np.concatenate((old.moments[kept] * rest[:, None], crop.moments)),
        )
        self.radiance = np.concatenate((self.radiance[kept], seen))


def _uncovered(cells: Cells, crop: Cells, half_angle: float) -> np.ndarray:
    """The share of each cell (n,) that a crop does not cover.

    Each cell of the crop is subtracted from the nearest cell. Well inside the crop it is 0: a sun counts once."""
    towards = crop.moments.sum(axis=0)
    near = np.flatnonzero(inside_crop(cells.directions, 1.3 * half_angle, towards))
    left = np.ones(len(cells.directions))
    if len(near):
        nearest = np.argmax(crop.directions @ cells.directions[near].T, axis=1)
        covered = np.bincount(nearest, crop.solid_angles, len(near)) / cells.solid_angles[near]
        left[near] = np.maximum(1 - covered, 0)
    left[inside_crop(cells.directions, 0.75 * half_angle, towards)] = 0
    return left


def _is_same(one: Source, other: Source) -> bool:
    """Whether two narrow sources became one in a closer look: each lies in the other's cone, and their widths are
    similar. Pieces of a wide source may lie in each other's cones too."""
    narrow, wide = sorted((one, other), key=lambda source: source.variance)
    is_near = owners([narrow], wide.direction[None])[0] == 0
    return is_near and wide.cone_radius < _NARROW and wide.variance < 4 * narrow.variance
