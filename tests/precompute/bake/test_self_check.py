# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake's self-check: where it looks, and whether it finds faults."""

from dataclasses import replace

import numpy as np
import pytest

from precompute.bake import self_check
from precompute.bake.ensemble import carry_out, plan
from precompute.bake.needs import Needs
from precompute.bake.request import BakeRequest
from precompute.measure.errors import measure
from precompute.measure.truths import truths
from precompute.optics.region import Region
from precompute.reflectance.matter import parse
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare

COHERENCE_M = 3e-6


def skin():
    """4 um of a bumpy skin, 150 nm high, that does not wrap."""
    x, y = np.meshgrid(*[np.arange(48) / 48] * 2)
    heights = 60e-9 * np.sin(2 * np.pi * 5.3 * x + np.sin(2 * np.pi * y)) + 15e-9 * np.cos(2 * np.pi * 2.6 * y)
    return prepare(HeightMap(heights, (4e-6 / 48,) * 2, "skin"))


def made_of(matter):
    """The relief, the plan and the table of a bake."""
    relief = skin()
    chosen = plan(relief, BakeRequest(coherence_length_m=COHERENCE_M, matter=parse(matter)))
    return relief, chosen, carry_out(chosen)


@pytest.fixture(scope="module")
def made():
    return made_of("dielectric")


@pytest.fixture(scope="module")
def gold():
    return made_of("gold")


def errors_of(made, baked):
    """The self-check's errors for a table of the same relief."""
    relief, chosen, _ = made
    return self_check.judge((relief,), chosen, "D65", progress=lambda *_: None).errors_of(baked)


@pytest.mark.parametrize("w_range", [(0.0, 2.0), (0.7, 1.3), (1.95, 2.0)])
def test_every_part_of_the_range_of_w_is_looked_at(w_range):
    """A deep relief is hardest at large w. Three values below 1.2 passed a bake with a dE00 of 22 at w = 1.9."""
    for seed in range(20):
        w = self_check.w_within(w_range, 4, np.random.default_rng(seed))
        assert w_range[0] <= w.min() and w.max() <= w_range[1]
        assert (np.diff(w) >= 0).all()
        if w_range == (0.0, 2.0):
            # Each cosine c has the density 2 c. The highest quarter of the sum of two cosines begins at 1.57.
            assert w[-1] > 1.55


@pytest.mark.night("tests/precompute/cli/test_bake_verb.py")
def test_it_agrees_with_the_reference(made):
    """At other directions, with the same kernel. A 99th percentile of a thousand pairs is exact to a third."""
    relief, chosen, baked = made
    own = errors_of(made, baked)
    truth = truths(relief, chosen.sigma_b, 4, pairs_each=800, step_m=4e-9, seed=3)
    exact = measure(truth, baked.candidate)
    assert own.p99 <= 1
    assert own.mean == pytest.approx(exact.mean, rel=0.35, abs=0.02)
    assert own.zero_order_dy == pytest.approx(exact.zero_order_dy, abs=3e-4)


@pytest.mark.night("tests/precompute/cli/test_matters.py")
@pytest.mark.parametrize("matter", ["dielectric", "gold"])
def test_a_small_region_is_still_looked_at(matter):
    """The region has one percent of the directions, so few pairs of a first draw lie in it."""
    relief, needs = skin(), Needs(Region((0.5, 0.9), (-0.1, 0.1)), w=(1.0, 1.4))
    chosen = plan(relief, BakeRequest(coherence_length_m=COHERENCE_M, matter=parse(matter), needs=needs))
    judge = self_check.judge((relief,), chosen, "D65", progress=lambda *_: None)
    errors = judge.errors_of(carry_out(chosen))
    assert errors.pairs > 1000 and errors.p99 <= 1


@pytest.mark.short("gold")
@pytest.mark.parametrize("matter", ["dielectric", "gold"])
def test_black_bright_and_shifted_bakes_fail(request, matter):
    made = request.getfixturevalue("gold" if matter == "gold" else "made")
    *_, baked = made
    for wrong in (0 * baked.terms, 1.3 * baked.terms, np.roll(baked.terms, 3, axis=2)):
        assert errors_of(made, replace(baked, terms=wrong)).p99 > 3
