# SPDX-License-Identifier: GPL-3.0-or-later
"""The allowance for the sampling of a 99th percentile, and sums of errors."""

import numpy as np
import pytest

from precompute.measure import errors
from precompute.measure.errors import Errors


def test_the_allowance_is_two_standard_deviations():
    """For an exponential tail the density at the percentile is exact. The standard deviation of 4000 samples is exact
    to 1 / sqrt(8000) = 1.1 %, and a percentile of 1500 values has a bias of the order of 1 / 15."""
    drawn = np.random.default_rng(5).exponential(0.2, (4000, 1500))
    p95, p99 = np.percentile(drawn, [95, 99], axis=1)
    allowances = [
        Errors(0, low, high, 0, 0, 0, 0, pairs=1500, share_deviation=(0.01 * 0.99 / 1500) ** 0.5).p99_allowance
        for low, high in zip(p95, p99, strict=True)
    ]
    assert np.mean(allowances) == pytest.approx(2 * p99.std(), rel=1 / 15)


def test_the_allowance_covers_errors_that_depend_on_w():
    """Sixteen groups of 100 pairs. The errors of a group are exponential, with a scale that varies from group to group
    by a factor of exp(0.3). In a normal distribution, two standard deviations above the estimate reach the true value
    in 97.7 % of the measurements. A percentile of 1600 pairs has a skewed distribution, and its deviation is itself
    estimated from sixteen groups, so five in six are asked. Pairs that count as independent do not reach that."""
    rng = np.random.default_rng(6)
    group = np.repeat(np.arange(16), 100)
    scales = np.exp(0.3 * rng.standard_normal((1000, 16)))
    truth = np.percentile(np.exp(0.3 * rng.standard_normal(10**6)) * rng.exponential(1, 10**6), 99)
    covered = {True: 0, False: 0}
    for scale in scales:
        above = np.repeat(scale, 100) * rng.exponential(1, 1600)
        found = np.percentile(above, 99)
        tail = (found - np.percentile(above, 95)) / np.log(5)
        for grouped in covered:
            deviation = errors._share_deviation(above > found, group if grouped else None)
            covered[grouped] += found + 2 * tail * deviation / 0.01 >= truth
    assert covered[True] > 833 > covered[False]


def test_separate_errors_are_added():
    found = Errors(1, 2, 3, 4, 0.1, 0.2, 0.3, pairs=1500, share_deviation=0.01, p99_of_w=5, p95_of_w=6)
    worse = found.worse_by(0.5, 0.05)
    assert (worse.mean, worse.p95, worse.p99, worse.max, worse.p99_of_w, worse.p95_of_w) == (
        1.5,
        2.5,
        3.5,
        4.5,
        5.5,
        6.5,
    )
    assert (worse.relative_dy, worse.relative_rms) == pytest.approx((0.15, 0.25))
    assert (worse.zero_order_dy, worse.pairs, worse.share_deviation) == (0.3, 1500, 0.01)
