# SPDX-License-Identifier: GPL-3.0-or-later
"""The errors of a bake under wider kernels, as the self-check finds them."""

from dataclasses import replace

import numpy as np
import pytest

from precompute.bake import self_check
from precompute.bake.ensemble import carry_out, plan
from precompute.bake.levels_and_basis import with_levels
from precompute.bake.make import make
from precompute.bake.needs import Needs
from precompute.bake.request import BakeRequest
from precompute.base.progress import silent
from precompute.measure.errors import Errors, measure, stated_errors
from precompute.measure.truths import draw_pairs
from precompute.optics.region import Region

from .conftest import COHERENCE_M, waves

# The errors of a first level without error.
NONE = Errors(0, 0, 0, 0, 0, 0, 0, pairs=1, share_deviation=0)


@pytest.fixture(scope="module")
def planned():
    """The plan of two crossed waves, and its table without levels."""
    chosen = plan(waves(), BakeRequest(coherence_length_m=COHERENCE_M))
    return chosen, carry_out(chosen)


def errors_of(stored, exact, first=NONE):
    return {each.level: each.errors for each in self_check.wide_errors(stored, exact, first, illuminant="D65")}


def test_every_level_and_every_middle_is_judged(planned):
    _, exact = planned
    stored = with_levels(exact)
    found = errors_of(stored, exact)
    assert list(found) == [half / 2 for half in range(1, 2 * len(stored.levels) - 1)]
    assert all(errors.pairs > 400 and 0 < errors.p99 < 4 for errors in found.values())


@pytest.mark.parametrize("level", [0.5, 2.0, 4.5])
def test_it_finds_what_sums_over_bins_find(planned, level):
    """The same readings against sums over the bins of the spectra under the wider kernel, on other directions of the
    same w. The 99th percentile of some 600 pairs is exact to a third, the mean to a tenth or so."""
    chosen, exact = planned
    stored = with_levels(exact)
    wide = replace(chosen, sigma_b=exact.sigma_b * stored.spacing.grown(level) ** 0.5)
    rng, truths = np.random.default_rng(5), []
    for w in self_check._values_of_w(exact):
        drawn = draw_pairs(self_check._spectrum(chosen.ensemble, rng), wide.sigma_b, w, count=150, rng=rng)
        truths.extend(self_check._truths(wide, drawn, w, ("D65",), "D65", silent))
    variance = wide.sigma_b**2 - exact.sigma_b**2
    by_sums = measure(
        truths, lambda u, v, w: (stored.scattered_over_w2(u, v, w, variance=variance), stored.zero_order_xyz(w))
    )
    found = errors_of(stored, exact)[level]
    assert found.p99 == pytest.approx(by_sums.p99, rel=0.35)
    assert found.mean == pytest.approx(by_sums.mean, rel=0.25)


def test_a_wrong_level_is_found(planned):
    """A level with 1.3 times its light, and the middles beside it."""
    _, exact = planned
    stored = with_levels(exact)
    wider = list(stored.wider)
    wider[2] = 1.3 * wider[2]
    right, wrong = errors_of(stored, exact), errors_of(replace(stored, wider=tuple(wider)), exact)
    for level, errors in wrong.items():
        if abs(level - 3) < 0.6:
            assert errors.p99 > right[level].p99 + 1
        else:
            assert errors.p99 == pytest.approx(right[level].p99, rel=1e-9)


def test_the_errors_of_the_first_level_are_added_by_squares(planned):
    _, exact = planned
    stored = with_levels(exact)
    alone = errors_of(stored, exact)[1.0]
    both = errors_of(stored, exact, replace(NONE, p95=0.3, p99=0.4))[1.0]
    assert both.p99 == pytest.approx(np.hypot(alone.p99, 0.4)) and both.p95 == pytest.approx(np.hypot(alone.p95, 0.3))


@pytest.mark.night("tests/precompute/bake/test_spread.py")
def test_a_bake_claims_the_worst_of_all_kernels():
    made = make([waves()], BakeRequest(coherence_length_m=COHERENCE_M))
    told = made.delta_e
    worst = max(made.wide, key=lambda each: each.errors.p99_most)
    assert told["p99"] == made.errors.p99 and made.errors.p99_most <= 1
    assert (told["wide_p99"], told["wide_level"]) == (worst.errors.p99, worst.level)
    assert told["claim"] == max(made.errors.p99_most, made.errors.p99_of_w, worst.errors.p99_most)
    small, large = (float(line.split()[4]) for line in stated_errors(told))
    assert 0 <= small - made.errors.p99_most < 0.01 and 0 <= large - worst.errors.p99_most < 0.01


def test_an_error_that_was_not_measured_is_not_stated():
    assert stated_errors({"p99_most": 0.301, "wide_p99_most": None}) == ["colour error up to 0.31 under small lamps"]
    assert stated_errors({"p99": 1.0, "p99_most": "x", "wide_p99_most": float("nan")}) == []


@pytest.mark.night("tests/precompute/bake/test_region.py")
def test_places_near_the_end_of_a_part_are_not_judged():
    """The light beyond the end is unknown, and the levels repeat the rim."""
    needs = Needs(Region((0.0, 0.9), (-0.4, 0.4)), w=(1.0, 1.6))
    made = make([waves()], BakeRequest(coherence_length_m=COHERENCE_M, needs=needs))
    pairs = [each.errors.pairs for each in made.wide]
    assert pairs[-1] < pairs[0] / 2
    assert all(each.errors.p99 < 4 for each in made.wide)
