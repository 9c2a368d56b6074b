# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of colours outside of a space."""

import numpy as np
import pytest

from laboratory.benchmarks import gamut
from precompute.colour.observer import observer, white_xyz
from precompute.colour.spaces import rgb_from_xyz
from precompute.measure.shown_colours import SHOWN_Y

# Light of one wavelength, which lies outside of every space, and a grey, which lies inside.
LINES = observer(np.array([450e-9, 520e-9, 560e-9, 620e-9]), "E")
LINES = SHOWN_Y * LINES / LINES[:, 1:2]
GREY = SHOWN_Y * white_xyz()[None]


def test_a_grey_has_a_nearest_colour_without_error():
    assert gamut.nearest(GREY, rgb_from_xyz("Rec.709")) == pytest.approx(0, abs=1e-6)


def test_the_search_is_at_least_as_good_as_the_mappings():
    row = gamut.row_of("lines", LINES, "Rec.709")
    assert row.outside == 1
    assert row.light[0] == pytest.approx(1, rel=1e-12) and row.light[1] > 1.05
    for mapped in (row.shown, row.cut):
        for one, least in zip(mapped, row.least, strict=True):
            assert 0 < least <= one


def test_three_lamps_are_mapped_each_and_as_a_sum():
    row = gamut.row_of("lines", LINES, "Rec.709")
    each, as_a_sum = row.three
    assert 0 < as_a_sum[0] < each[0]
