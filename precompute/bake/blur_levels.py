# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a table's wider blur levels, each from a finer copy of the level before by a blur and fewer texels.

The step between texels grows by a factor that is no integer in general, and the blur is narrower than a texel of the
finer level. A Gaussian sampled so coarsely is no longer a Gaussian. Therefore the samples are first interpolated to a
smooth function of all their frequencies, and this function is blurred.

Texels that just resolve their kernel repeat a few percent of its spectrum. If each level came from the texels of the
level before, these errors would add up: at level 14 of the scan of Elaphe the dE00's p99 would be 1.8 instead of 1.0.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np

from ..maths import bspline
from ..maths.banded import banded_sums
from ..optics.region import FARTHEST
from ..table.table import Table
from ..table.tiling import SPACINGS, TILE_PADDING, Cell, cell_for

_Mode = Literal["constant", "edge"]
# The interpolation is a sinc under a Gaussian of this standard deviation, in samples. It is cut off at four standard
# deviations, where it is below 1e-5. A blur is cut off at six of its own.
_WINDOW, _WINDOW_REACH, _BLUR_REACH = 2.0, 8, 6.0
# Number of frequencies, from 0 to twice the highest of the samples, at which a weight's spectrum is summed. The sum
# repeats at distances of this many samples, far beyond the reach.
_FREQUENCIES = 64
# The next level is made from texels finer by this factor. With 2, no level of the scan of Elaphe was more accurate.
_FINER = 1.5


def narrower(sigma: float, texel: float) -> float:
    """The standard deviation of the kernel to sample at the texels, so that a reading has the kernel sigma.

    Reading by B-splines adds the variance bspline.VARIANCE texel^2."""
    return math.sqrt(sigma**2 - bspline.VARIANCE * texel**2)


def with_levels(table: Table, cell: Cell | None = None, *, coarser: float = 1.0) -> Table:
    """Add the wider blur levels to a table: a given cell's, or as many and as close as memory allows. If the closest do
    not fit, the wider levels may have `coarser` times fewer texels to their kernels than level 0.

    A wider kernel reaches past the rim of the table. If the table ends at |u| = 2, there is no light beyond the rim. If
    its region ends earlier, the values at the rim are repeated. Light beyond the sky, in the corners of a table that
    ends at |u| = 2, is left out of the wider levels."""
    modes: list[_Mode] = [
        "constant" if low <= 1e-9 - 2 and high >= 2 - 1e-9 else "edge" for low, high in table.region[::-1]
    ]
    cell = cell or _cell(table, coarser)
    # The kernel that the source's texels sample, in texels of level 0, and the one to sample at a level's texels.
    held = narrower(table.sigma_b, table.texel) / table.texel
    found, source, finest = [table.terms], table.terms * sky_share(table)[..., None], 1.0
    for level in range(1, cell.levels):
        texel = cell.texels(level)
        sampled = narrower(table.sigma_b * math.sqrt(cell.spacing.grown(level)), texel * table.texel) / table.texel
        added = math.sqrt(sampled**2 - held**2) / finest
        own = _resampled(source, added, step=texel / finest, inner=cell.inner_of(level), modes=modes)
        found.append(np.ascontiguousarray(own))
        finer = texel / _FINER
        if finer > 1 + 1e-9 and level + 1 < cell.levels:
            rows, columns = (math.ceil((count - 1) / finer - 1e-9) + 1 for count in cell.inner)
            source = _resampled(source, added, step=finer / finest, inner=(rows, columns), modes=modes)
            finest, held = finer, sampled
    return replace(table, wider=tuple(found[1:]), spacing=cell.spacing, coarser=cell.coarser)


def sky_share(table: Table) -> np.ndarray:
    """The share (rows, columns) of each texel of level 0 that lies in the sky: within the |(u, v)| of any pair."""
    v, u = table.axes
    inside = FARTHEST / table.plate_ior - np.hypot(u, v[:, None])
    return np.clip(inside / table.texel + 0.5, 0, 1).astype(np.float32)


def _cell(table: Table, coarser: float) -> Cell:
    """The cell with the closest levels that memory allows, if need be with coarser texels on the wider ones."""
    side = math.ceil(4 / table.texel - 1e-9) + 1
    cells = len(table.terms) * (table.terms.shape[-1] // 3)
    choose = partial(cell_for, cells, table.inner, table.sigma_b, whole=(side, side))
    even = choose()
    return even if even.spacing == SPACINGS[0] else choose(coarser=coarser)


def _resampled(
    tiles: np.ndarray, sigma: float, *, step: float, inner: tuple[int, int], modes: Sequence[_Mode]
) -> np.ndarray:
    """Blur tiles (K, rows, columns, 3) by a Gaussian of sigma texels, with `inner` inner rows and columns that are
    `step` texels apart."""
    for axis, (count, mode) in enumerate(zip(inner, modes, strict=True)):
        along = np.moveaxis(tiles, 1 + axis, 1)
        along = _blurred(along, sigma, step=step, count=count + 2 * TILE_PADDING, mode=mode)
        tiles = np.moveaxis(along, 1, 1 + axis)
    return tiles


def _blurred(terms: np.ndarray, sigma: float, *, step: float, count: int, mode: _Mode) -> np.ndarray:
    """Blur terms (K, rows, ...) along axis 1 by a Gaussian of sigma rows, at `count` places that are `step` rows apart.
    Place TILE_PADDING is the first inner row, at the same index. `mode` is numpy.pad's."""
    at = TILE_PADDING + step * (np.arange(count) - TILE_PADDING)
    reach = max(_WINDOW_REACH, math.ceil(_BLUR_REACH * sigma))
    rows = np.floor(at).astype(int)[:, None] + np.arange(1 - reach, 1 + reach)
    shares = blur_weights(at - rows[:, 0], rows.shape[1], sigma)
    sums = banded_sums(terms.reshape(*terms.shape[:2], -1), rows[:, 0], shares, edge=mode == "edge")
    return sums.reshape(*sums.shape[:2], *terms.shape[2:])


def blur_weights(first: np.ndarray, count: int, sigma: float) -> np.ndarray:
    """The weights (places, count) of samples around each place that give the sampled function under a Gaussian blur of
    `sigma`. In sample steps, a place is at the distance `first` (places,) beyond the first sample. Each place's weights
    sum to 1.

    Their spectrum is the Gaussian's, exp(-2 pi^2 sigma^2 f^2), times that of the interpolation: 1 within |f| < 1 / 2
    and 0 beyond, with an edge softened by the window."""
    f = (np.arange(_FREQUENCIES) + 0.5) / _FREQUENCIES
    sharp = math.pi * math.sqrt(2) * _WINDOW
    interpolation = np.array([math.erf(sharp * (0.5 + each)) + math.erf(sharp * (0.5 - each)) for each in f]) / 2
    spectrum = interpolation * np.exp(-2 * (math.pi * sigma * f) ** 2)
    # The cosine of a distance is one of the difference of two angles.
    place, sample = (2 * math.pi * each[:, None] * f for each in (first, np.arange(count)))
    weights = (np.cos(place) * spectrum) @ np.cos(sample).T + (np.sin(place) * spectrum) @ np.sin(sample).T
    return weights / weights.sum(axis=-1, keepdims=True)
