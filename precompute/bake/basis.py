# SPDX-License-Identifier: GPL-3.0-or-later
"""The table's functions of w, learnt from the table.

Of the light that a surface scatters, the dependence on w has a few shapes that recur at all places (u, v). The singular
vectors of the table are these shapes, strongest first: with the same error, fewer of them are needed than of Chebyshev
polynomials. A renderer reads one tile for each.

A place counts by what an error there does to its colour. Lightness grows as the cube root of luminance Y, so that an
error dY is seen as Y^(-2/3) dY. Each w counts the same, relative to the light that there is with it: where all is
grazing, the light is little, and an exposure shows it.
"""

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..maths import chebyshev
from ..table.table import Table

# About this number of the table's texels are looked at.
_TEXELS = 40_000
# Texels, and values of w, that are darker than this share of the brightest count as much as those that are as dark: no
# exposure shows them.
_DARK = 1e-4


def with_learnt_basis(table: Table, keeps: Callable[[Table], bool]) -> Table:
    """The table by as few functions of w as `keeps` agrees to. `table` has Chebyshev polynomials and no wider
    levels."""
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
