# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing frequencies as a material does, one random texel each, against the density that weights them."""

import numpy as np
import pytest

from precompute.bake.sample_draws import densities
from tests.precompute.chi_square import LIMIT, equal_cells, unlikeliness

DRAWS = 20_000


@pytest.mark.parametrize(("freedom", "critical"), [(10, 29.588), (63, 103.442), (500, 603.446)])
def test_the_measure_knows_the_tables_of_chi_square(freedom, critical):
    """At a chance of one in a thousand. All of the excess is in one of many bins, and taken from the others."""
    expected = np.full(freedom + 1, 1e9)
    excess = np.sqrt(critical * 1e9 * freedom / (freedom + 1))
    counts = expected - excess / freedom
    counts[0] = expected[0] + excess
    assert unlikeliness(counts, expected) == pytest.approx(3.0902, abs=0.02)


def test_random_texels_pass_a_chi_square_test(scan):
    """In 20 x 20 cells of rows and columns of bins; nearly empty cells are joined."""
    series, found, (row, column) = scan
    (pdf,) = densities([series])
    rows, columns = (equal_cells(pdf.sum(axis=axis, dtype=float), 20) for axis in (1, 0))
    cell = rows[:, None] * 20 + columns
    share = np.bincount(cell.ravel(), pdf.astype(float).ravel(), minlength=400)
    little = share * DRAWS < 10
    rng = np.random.default_rng(0)

    def score(drawn):
        counts = np.bincount(drawn, minlength=400)
        together = [np.append(each[~little], each[little].sum()) for each in (counts, share / share.sum() * DRAWS)]
        return unlikeliness(*together)

    y, x = rng.integers(0, row.shape[0], (2, DRAWS))
    assert score(cell[row[y, x], column[y, x]]) < LIMIT
    even = rng.integers(0, pdf.shape[0], DRAWS), rng.integers(0, pdf.shape[1], DRAWS)
    assert score(cell[even]) > 10
