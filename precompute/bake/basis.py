# SPDX-License-Identifier: GPL-3.0-or-later
"""Learns a table's functions of w from the table.

terms_and_texels.py chooses the number of Chebyshev terms that a bake starts with. make.py accepts the fewest learnt
functions that keep the colour error.

The scattered light depends on w by a few shapes that recur at all places (u, v). The singular vectors of the table are
these shapes, strongest first. They are fewer than Chebyshev polynomials of equal error, and a renderer reads one tile
for each.

A place is weighted by the colour error it can cause. Lightness grows as the cube root of luminance Y, so an error dY is
seen as Y^(-2/3) dY. Each w has equal weight relative to its light, because exposures show faint light too.
"""

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..maths import chebyshev
from ..measure.errors import Errors, Truth, measure
from ..measure.pairs import Pairs, cosine_weighted, pair_about
from ..optics.plate import least_cosine
from ..table.table import Table
from ..table.tiling import TILE_PADDING

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
