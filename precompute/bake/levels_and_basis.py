# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a table's wider blur levels, and reduces its Chebyshev polynomials in w to fewer functions.

Each level is made from a finer copy of the level before, by a blur and fewer texels. The step between texels grows by a
factor that is no integer in general, and the blur is narrower than a texel of the finer level. A Gaussian sampled so
coarsely is no longer a Gaussian. Therefore the samples are first interpolated to a smooth function of all their
frequencies, and this function is blurred.

Texels that just resolve their kernel repeat a few percent of its spectrum. If each level came from the texels of the
level before, these errors would add up: at level 14 of the scan of Elaphe the dE00's p99 would be 1.8 instead of 1.0.

The functions of w are learnt from the table. plan.py chooses the number of Chebyshev terms that a bake starts with, and
make.py accepts the fewest learnt functions that keep the colour error. The scattered light depends on w by a few shapes
that recur at all places (u, v). The singular vectors of the table are these shapes, strongest first. They are fewer
than Chebyshev polynomials of equal error, and a renderer reads one tile for each.

A place is weighted by the colour error it can cause. Lightness grows as the cube root of luminance Y, so an error dY is
seen as Y^(-2/3) dY. Each w has equal weight relative to its light, because exposures show faint light too."""

import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np

from ..maths import bspline, chebyshev
from ..maths.bspline import banded_sums
from ..measure.errors import Errors, Pairs, Truth, cosine_weighted, measure, pair_about
from ..optics.plate import least_cosine
from ..optics.region import FARTHEST
from ..table.blur_levels import SPACINGS, TILE_PADDING, Cell, cell_for
from ..table.table import Table

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


def on_grid(table: Table, axes: tuple[np.ndarray, np.ndarray], *, sigma_b: float) -> Table:
    """A table without wider levels under a kernel at least as wide, at texels whose centres are at v and u.

    The texels must be at most as coarse beside the new kernel as the present ones beside theirs."""
    texel = float(axes[0][1] - axes[0][0])
    held, sampled = narrower(table.sigma_b, table.texel), narrower(sigma_b, texel)
    first, own = ([axis[TILE_PADDING] for axis in each] for each in (axes, table.axes))
    rows, columns = (len(axis) - 2 * TILE_PADDING for axis in axes)
    terms = _resampled(
        table.terms, math.sqrt(max(sampled**2 - held**2, 0.0)) / table.texel, step=texel / table.texel,
        inner=(rows, columns), modes=("edge", "edge"),
        first=tuple((new - old) / table.texel for new, old in zip(first, own, strict=True)),
    )  # fmt: skip
    corner = float(axes[0][0]), float(axes[1][0])
    return replace(table, terms=terms, wider=(), sigma_b=sigma_b, texel=texel, first=corner)


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
    tiles: np.ndarray, sigma: float, *, step: float, inner: tuple[int, int], modes: Sequence[_Mode],
    first: tuple[float, float] = (0.0, 0.0),
) -> np.ndarray:  # fmt: skip
    """Blur tiles (K, rows, columns, 3) by a Gaussian of sigma texels, with `inner` inner rows and columns that are
    `step` texels apart. `first`: how many texels the first inner row and column lie beyond the present ones."""
    for axis, (count, mode) in enumerate(zip(inner, modes, strict=True)):
        along = np.moveaxis(tiles, 1 + axis, 1)
        along = _blurred(along, sigma, step=step, count=count + 2 * TILE_PADDING, mode=mode, first=first[axis])
        tiles = np.moveaxis(along, 1, 1 + axis)
    return tiles


def _blurred(terms: np.ndarray, sigma: float, *, step: float, count: int, mode: _Mode, first: float) -> np.ndarray:
    """Blur terms (K, rows, ...) along axis 1 by a Gaussian of sigma rows, at `count` places that are `step` rows apart.
    Place TILE_PADDING is `first` rows beyond the first inner row. `mode` is numpy.pad's."""
    at = TILE_PADDING + first + step * (np.arange(count) - TILE_PADDING)
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


# About this number of the table's texels is used.
_TEXELS = 40_000
# Texels, and values of w, darker than this share of the brightest are weighted like this share: no exposure shows them.
_DARK = 1e-4
# The number of values of w, and of direction pairs at each, on which two tables are compared. Reading a table is fast,
# so there are more values of w than in the self-check.
_GROUPS, _PAIRS = 16, 600
# The first and the last of these values of w, as shares of the range: of the whole range they are 0.08 and 1.995. At
# the very ends the only directions are along the horizon and along the normal.
_ENDS = 0.04, 0.9975


# The shares of the requested error that a basis of w may add, at values of w outside the self-check: at all together,
# and at each alone. Errors of different origin add by their squares: 0.7 without the basis and 0.5 by it are 0.9
# together, 0.7 and 0.8 are 1.06.
_OF_BASIS, _OF_BASIS_AT_ONE_W = 0.5, 1.0


def adds_little(added: Errors, at_one_w: float, delta_e: float) -> bool:
    """Whether the differences of a table in another basis of w (see comparison) are small beside a requested dE00."""
    return added.over(delta_e) <= _OF_BASIS and at_one_w <= _OF_BASIS_AT_ONE_W * delta_e


def with_learnt_basis(table: Table, keeps: Callable[[Table], bool]) -> Table:
    """Reduce a table of Chebyshev polynomials, without wider levels, to the fewest functions that `keeps` accepts."""
    if not table.terms.any():
        return table
    functions, tiles = learnt_basis(table)

    def by(count: int) -> Table:
        terms = np.tensordot(tiles[:count].astype(np.float32), table.terms, axes=1)
        return replace(table, terms=terms, basis=functions[:count])

    counts = range(1, len(functions))
    found = bisect_left(counts, True, key=lambda count: keeps(by(count)))
    return by(counts[found]) if found < len(counts) else table


def learnt_basis(table: Table) -> tuple[np.ndarray, np.ndarray]:
    """The functions of w, strongest first, as Chebyshev coefficients (K, K), and the matrix (K, K) from the table's
    terms to the tiles of these functions. The greatest value of a function over the range of w is 1."""
    count, (low, high) = len(table.terms), table.w_range
    w = chebyshev.nodes(4 * count, low, high)
    at_w = chebyshev.polynomials((2 * w - low - high) / (high - low), count)
    # The light is w^2 times the sum of the terms.
    light = at_w * w[:, None] ** 2
    step = max(1, round((table.terms[0, ..., 0].size / _TEXELS) ** 0.5))
    terms = table.terms[:, ::step, ::step].astype(float)
    luminance = np.abs(np.tensordot(light, terms[..., 1], axes=1))
    of_place, of_w = luminance.mean(axis=0), luminance.mean(axis=(1, 2))[:, None]
    share = (of_place + _DARK * of_place.max()) ** (-2 / 3)
    light /= of_w + _DARK * of_w.max()
    measure = np.linalg.qr(light, mode="r")  # |measure c| = |light c|
    seen = (np.tensordot(measure, terms, axes=1) * share[..., None]).reshape(count, -1)
    vectors = np.linalg.eigh(seen @ seen.T)[1][:, ::-1]
    functions = np.linalg.solve(measure, vectors).T
    values = functions @ at_w.T
    peaks = values[np.arange(count), np.abs(values).argmax(axis=1)][:, None]
    return functions / peaks, peaks * (vectors.T @ measure)


def comparison(table: Table, illuminant: str) -> Callable[[Table], tuple[Errors, float]]:
    """Return a function that measures how much another table of the same surface differs.

    It returns the errors at all values of w together, and the largest p99 at one w, exposed as a picture of this w
    alone. The values of w are equally spaced and include the ends of the range. Grazing light has a small w and few
    direction pairs in the self-check, but it may fill a scene. At each w half of the pairs are cosine weighted, half
    drawn from the table's light."""
    rng = np.random.default_rng(1)
    least = least_cosine(table.plate_ior)
    low, high = max(table.w_range[0], 2 * least), table.w_range[1]
    found = []
    for w in low + (high - low) * np.linspace(*_ENDS, _GROUPS):
        halves = cosine_weighted(w, _PAIRS // 2, rng, least=least), _lit_pairs(table, w, _PAIRS // 2, rng)
        drawn = np.repeat([False, True], [len(half[0]) for half in halves])
        wi, wr = (np.concatenate(ways) for ways in zip(*halves, strict=True))
        pairs = Pairs(wi, wr, drawn).within(table.region)
        scattered, zero_order = table.candidate(pairs.u, pairs.v, w)
        found.append(Truth(w, pairs, scattered * w**2, zero_order))

    def differences(other: Table) -> tuple[Errors, float]:
        answers = {one.w: other.candidate(one.pairs.u, one.pairs.v, one.w) for one in found}

        def over(truths: list[Truth]) -> Errors:
            return measure(truths, lambda u, v, w: answers[w], illuminant, ratio_ior=table.ratio_ior)

        return over(found), max((over([one]).p99 for one in found if len(one.pairs.wi)), default=0.0)

    return differences


def _lit_pairs(table: Table, w: float, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw unit vectors wi and wr (up to count, 3) whose (u, v) follow the table's luminance at w."""
    uv = lit_places(table, table.at_w(w)[..., 1], w, count=count, rng=rng)
    return pair_about(np.column_stack([uv, np.full(len(uv), w)]), rng, least=least_cosine(table.plate_ior))


def lit_places(table: Table, luminance: np.ndarray, w: float, *, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draw (u, v) (up to count, 2) that follow the luminance (rows, columns) at w of a table's texels."""
    v, u = (axis[TILE_PADDING:-TILE_PADDING] for axis in table.axes)
    luminance = luminance[TILE_PADDING:-TILE_PADDING, TILE_PADDING:-TILE_PADDING]
    # Two unit vectors above the surface whose sum has the component w reach no farther in u and v.
    reached = u**2 + v[:, None] ** 2 < 4 - w**2
    cumulative = np.cumsum(np.where(reached, np.maximum(luminance, 0), 0), dtype=float)
    if cumulative[-1] <= 0:
        return np.empty((0, 2))
    row, column = np.divmod(np.searchsorted(cumulative, rng.random(count) * cumulative[-1], "right"), len(u))
    uv = np.stack([u[column], v[row]], axis=-1) + table.texel * rng.uniform(-0.5, 0.5, (count, 2))
    return uv[np.sum(uv**2, axis=1) < 4 - w**2]
