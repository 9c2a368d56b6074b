# SPDX-License-Identifier: GPL-3.0-or-later
"""Brings several bakes to one layout, so that a material reads one of them at each place at the price of one.

Variation shows one of several scans at each place. A material that reads separate bakes reads all of them and discards
all but one. Bakes with the same kernel, texels, blur levels and functions of w can be layers of one picture
(table/atlas.py). The material then chooses a layer by an offset, and reads only that layer.

The common kernel is the widest one. The common texels resolve it as well as the finest bake resolves its own kernel.
The functions of w are learnt from all bakes together: the fewest that add little to each bake's requested error
(levels_and_basis.py)."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..table import atlas
from ..table.table import Table
from .levels_and_basis import adds_little, comparison, learnt_basis, on_grid, with_levels
from .plan import texel_middles

# A kernel is widened by at most this factor: an eighth, which on a line beside another is hardly seen.
_WIDER_MAX = 1.125
# The functions of w are learnt from at most about this number of each table's rows and columns.
_SIDE = 256


def can_be_layers(tables: Sequence[Table]) -> bool:
    """Whether tables can have one layout: of one light, matter and plate, and of kernels of about the same width. If
    they have not the same texels, each must hold every pair of directions."""
    first, *others = tables
    kernels = [table.sigma_b for table in tables]
    return (
        bool(others)
        and any(table.terms.any() for table in tables)
        and all(_alike(first) == _alike(table) for table in others)
        and max(kernels) <= _WIDER_MAX * min(kernels)
        and (_have_one_grid(tables) or all(atlas.layout_of(table).whole for table in tables))
    )


def as_layers(tables: Sequence[Table], delta_e: float) -> tuple[Table, ...]:
    """The same light by tables of one grid, of the same functions of w and blur levels. `delta_e` is the dE00 that each
    was asked to keep. can_be_layers must hold."""
    if not _have_one_grid(tables):
        sigma_b = max(table.sigma_b for table in tables)
        texel = min(table.texel / table.sigma_b for table in tables) * sigma_b
        farthest = atlas.layout_of(tables[0]).farthest
        axis = texel_middles(-farthest, farthest, texel)
        tables = [on_grid(table, (axis, axis), sigma_b=sigma_b) for table in tables]
    functions, to_tiles = learnt_basis(_together(tables))
    compared = [comparison(table, table.illuminant) for table in tables]
    precise = any(table.precision is np.float32 for table in tables)

    def by(count: int, precision: type[np.floating]) -> list[Table]:
        return [_in_basis(table, functions[:count], to_tiles[:count], precision) for table in tables]

    def keeps(count: int, precision: type[np.floating] = np.float32) -> bool:
        pairs = zip(compared, by(count, precision), strict=True)
        return all(adds_little(*differences(_stored(table)), delta_e) for differences, table in pairs)

    counts = range(max(len(table.terms) for table in tables), len(functions))  # each table has the fewest it needs
    count = counts.start + bisect_left(counts, True, key=keeps)
    halves_do = not precise and keeps(count, np.float16)
    found = by(count, np.float16 if halves_do else np.float32)
    first = with_levels(found[0], coarser=max(table.coarser / table.spacing.stretch for table in tables))
    return first, *(with_levels(table, first.cell) for table in found[1:])


def _alike(table: Table) -> tuple[object, ...]:
    """What tables of one layout share from the start."""
    zero_order = table.zero_order.shape
    return table.illuminant, table.ratio_ior, table.plate_ior, table.w_range, zero_order, table.gains is None


def _have_one_grid(tables: Sequence[Table]) -> bool:
    grids = [(table.tile, table.sigma_b, table.texel, *table.first) for table in tables]
    return all(grid[0] == grids[0][0] and np.allclose(grid[1:], grids[0][1:], rtol=1e-9, atol=0) for grid in grids)


def _polynomials(table: Table, count: int) -> np.ndarray:
    """The table's functions of w (K, count) as sums of T_0 to T_(count-1)."""
    return np.pad(table.basis, ((0, 0), (0, count - table.basis.shape[1])))


def _together(tables: Sequence[Table]) -> Table:
    """Texels of all tables in one table of Chebyshev polynomials, one table's above the other's."""
    count, step = max(table.basis.shape[1] for table in tables), 1 + min(tables[0].tile) // _SIDE
    terms = [
        np.tensordot(_polynomials(each, count).T.astype(np.float32), each.terms[:, ::step, ::step], axes=1)
        for each in tables
    ]
    return replace(tables[0], terms=np.concatenate(terms, axis=1), basis=np.eye(count), wider=())


def _in_basis(table: Table, functions: np.ndarray, to_tiles: np.ndarray, precision: type[np.floating]) -> Table:
    """Express a table, without wider levels, in other functions of w (K, J). `to_tiles` (K, J) gives their tiles from
    the polynomials' tiles."""
    matrix = to_tiles @ _polynomials(table, to_tiles.shape[1]).T
    terms = np.tensordot(matrix.astype(np.float32), table.terms, axes=1)
    return replace(table, terms=terms, basis=functions, wider=(), precision=precision)


def _stored(table: Table) -> Table:
    """A table rounded as in its picture."""
    return atlas.unpack(*atlas.pack(table))
