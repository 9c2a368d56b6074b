# SPDX-License-Identifier: GPL-3.0-or-later
"""The functions of w that a table learns from its own tiles."""

from dataclasses import replace

import numpy as np
import pytest

from precompute.bake.ensemble import carry_out, plan
from precompute.bake.levels_and_basis import comparison, learnt_basis, with_learnt_basis
from precompute.bake.make import make
from precompute.bake.request import BakeRequest
from precompute.maths import chebyshev
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed
from precompute.table.atlas import pack, unpack

REQUEST = BakeRequest(coherence_length_m=6e-6)


@pytest.fixture(scope="module")
def relief():
    return prepare(blazed(periods=4, rows=96))


@pytest.fixture(scope="module")
def baked(relief):
    return carry_out(plan(relief, REQUEST))


def test_all_functions_are_the_polynomials_again(baked):
    functions, tiles = learnt_basis(baked)
    # Both matrices are products with a condition number under 1e4, in double precision.
    np.testing.assert_allclose(functions.T @ tiles, np.eye(len(functions)), atol=1e-10)


def test_the_greatest_value_of_a_function_is_one(baked):
    functions, _ = learnt_basis(baked)
    low, high = baked.w_range
    w = chebyshev.nodes(4 * len(functions), low, high)
    values = functions @ chebyshev.polynomials((2 * w - low - high) / (high - low), len(functions)).T
    np.testing.assert_allclose(np.abs(values).max(axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose(values.max(axis=1), 1, rtol=1e-12)


def test_a_table_of_one_shape_learns_this_shape(baked):
    shape = np.random.default_rng(0).standard_normal(len(baked.terms)).astype(np.float32)
    terms = shape[:, None, None, None] * np.abs(baked.terms[:1])
    table = replace(baked, terms=terms)
    fewer = with_learnt_basis(table, lambda candidate: len(candidate.terms) >= 1)
    assert len(fewer.terms) == 1
    for w in (0.3, 1.0, 1.9):
        # Single precision, over sums of some ten terms.
        np.testing.assert_allclose(fewer.at_w(w), table.at_w(w), atol=1e-5 * np.abs(terms).max())


def test_the_fewest_that_are_agreed_to_are_taken(baked):
    asked = []

    def keeps(candidate):
        asked.append(len(candidate.terms))
        return len(candidate.terms) >= 3

    found = with_learnt_basis(baked, keeps)
    assert len(found.terms) == 3 and {2, 3} <= set(asked)
    assert with_learnt_basis(baked, lambda _: False) is baked


def test_a_mirror_learns_nothing(baked):
    black = replace(baked, terms=0 * baked.terms)
    assert with_learnt_basis(black, lambda _: True) is black


@pytest.mark.night("tests/precompute/bake/test_region.py")
def test_a_bake_has_fewer_functions_than_polynomials_and_keeps_its_error(relief):
    made = make([relief], REQUEST)
    assert made.layout.terms < made.layout.polynomials
    assert {len(level) for level in made.table.levels} == {made.layout.terms} and len(made.table.levels) > 1
    assert made.errors.p99_most <= 1


@pytest.mark.night("tests/precompute/bake/test_spread.py")
def test_the_file_holds_the_functions(relief):
    table = make([relief], REQUEST).table
    again = unpack(*pack(table))
    np.testing.assert_array_equal(again.basis, table.basis)
    u, v = np.random.default_rng(1).uniform(-1, 1, (2, 50))
    np.testing.assert_allclose(again.scattered_over_w2(u, v, 1.3), table.scattered_over_w2(u, v, 1.3), rtol=1e-6)


def test_no_w_loses_its_colours(relief):
    """Grazing light, in one of sixteen equal parts of the range of w, keeps the error bound too; and so does each w."""
    differences = comparison(carry_out(plan(relief, REQUEST)), "D65")
    made = make([relief], REQUEST)
    together, at_one_w = differences(made.table)
    # Half of the asked error together, all of it at one w; and the file's rounding.
    assert made.layout.terms < made.layout.polynomials and together.p99 <= 0.6 and at_one_w <= 1.1


@pytest.mark.parametrize("end", [0.08, 1.995])
def test_the_ends_of_w_are_compared(baked, end):
    """Functions that are 30 % too large at one end of w alone, within a Gaussian of standard deviation 0.01. At Y = 1
    this is a dE00 of 38.7 * 0.3 / 3 / 1.75 = 2.2 or more: L* grows by a third of the light's relative growth."""
    count = 300
    w = chebyshev.nodes(count, *baked.w_range)
    wrong = 1 + 0.3 * np.exp(-0.5 * ((w - end) / 0.01) ** 2)
    functions = chebyshev.polynomials(w - 1, len(baked.terms)) * wrong[:, None]
    faulty = replace(baked, basis=(chebyshev.coefficients_from_nodes(count) @ functions).T)
    together, at_one_w = comparison(baked, "D65")(faulty)
    assert at_one_w > 2 > together.mean
