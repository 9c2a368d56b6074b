# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of kernels between two levels."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from laboratory.benchmarks import levels
from precompute.table.table import Spacing, Table

RATIO = st.sampled_from([1.5, 2.0, 4.0])


@given(st.floats(1e-3, 1e3), st.floats(0, 4), RATIO, st.floats(0, 1))
def test_the_mixes_of_a_lone_order(variance, away, ratio, at):
    """One mix is the order under the kernel between, the other the mixture with its variance. The logarithms of values
    down to e^-8 are exact to 1e-15 of 8."""
    squared, grown = away**2 * variance, ratio**at

    def order(s):
        return np.array([np.exp(-0.5 * squared / s) / s])

    ends = order(variance), order(ratio * variance)
    assert levels.gaussian(*ends, grown, ratio) == pytest.approx(order(grown * variance), rel=1e-12)
    share = (grown - 1) / (ratio - 1)
    assert levels.linear(*ends, grown, ratio) == pytest.approx((1 - share) * ends[0] + share * ends[1], rel=1e-12)


@given(RATIO, st.lists(st.floats(-1, 1), min_size=2, max_size=2), st.floats(0, 1))
def test_no_mix_makes_a_number_of_nothing(ratio, ends, at):
    """If a level is black or negative, the closed form of a lone order gives black."""
    finer, coarser = (np.array([[each, 0.0]]) for each in ends)
    for mix in levels.MIXES.values():
        assert np.isfinite(mix(finer, coarser, ratio**at, ratio)).all()
    if min(ends) <= 0:
        assert not levels.gaussian(finer, coarser, ratio**at, ratio).any()


def test_a_uniform_table_has_its_light_under_every_kernel():
    """`light` of equal levels is 1 for the product's mix, but not for a formula for lone orders."""
    tile = np.ones((1, 60, 60, 3), np.float32)
    table = Table(
        tile,
        np.zeros((2, 3)),
        0.08,
        4 / 55,
        "D65",
        wider=(tile[:, :50, :50], tile[:, :41, :41]),
        spacing=Spacing(1.5, 0.0),
    )
    assert levels.light(table, levels.linear, 1.25) == pytest.approx(1, rel=1e-6)
    assert levels.light(table, levels.gaussian, 1.25) == pytest.approx(1.5**0.6 / 1.25, rel=1e-6)


def test_nearer_levels_are_truer(tmp_path, capsys):
    path = tmp_path / "levels.json"
    levels.main(["--surfaces", "sample:sinusoidal", "--growths", "2", "--json", str(path)])
    rows = {(row["ratio"], row["mix"]): row for row in json.loads(path.read_text())["rows"]}
    assert set(rows) == {(spacing.ratio, mix) for spacing in levels.TRIED for mix in ("linear", "Gaussian")}
    told = capsys.readouterr().out
    assert told.count("sample:sinusoidal") == len(rows)
    nearest, farthest = rows[1.5, "linear"], rows[4.0, "linear"]
    assert nearest["p99"] < 3 < farthest["p99"]
    assert nearest["mebibytes"] > farthest["mebibytes"]
    # A table of orders within the rim keeps its light, to single precision.
    assert farthest["light"] == pytest.approx(1, abs=1e-3)
