# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a renderer's space is from a bake's colours."""

import numpy as np
import pytest

from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.bake.self_check import shown_colours
from precompute.colour.observer import observer, white_xyz
from precompute.colour.spaces import RGB_SPACES
from precompute.measure.shown_colours import SHOWN_Y, is_shown, shown_in, told
from precompute.surface.relief import prepare
from precompute.surface.samples.catalogue import make_sample
from precompute.surface.samples.ruled_gratings import blazed


@pytest.fixture(scope="module")
def blaze():
    return shown_colours(bake(prepare(blazed()), BakeRequest(delta_e=3, coherence_length_m=12e-6)))


def test_a_blaze_is_purer_than_rec_709_and_less_so_than_the_wide_spaces(blaze):
    assert set(blaze) == set(RGB_SPACES)
    assert blaze["Rec.709"].outside > blaze["Rec.2020"].outside
    assert blaze["Rec.709"].p50 > 2 * blaze["Rec.2020"].p50
    assert all(found.p95 >= found.p50 for found in blaze.values())


def test_a_grey_is_in_every_space_and_a_line_in_none():
    for space in RGB_SPACES:
        grey = np.array([SHOWN_Y * white_xyz()])
        found = shown_in(grey, grey, space)
        assert (found.outside, found.p50, found.p95) == (0, 0, 0)
    line = observer(np.array([520e-9]), "E")
    line = SHOWN_Y * line / line[:, 1:2]
    found = shown_in(line, line, "Rec.709")
    assert found.outside == 1 and found.p50 == found.p95 > 5


def test_a_mirror_has_no_colours():
    """It scatters no light, and its mirror image is not among the directions."""
    flat = bake(prepare(make_sample("flat")), BakeRequest(delta_e=3, coherence_length_m=12e-6))
    assert shown_colours(flat) == {} and told({}) == ""


def test_the_line_says_share_and_error(blaze):
    record = {space: found.as_dict() for space, found in blaze.items()}
    line = told(record)
    assert (
        line.startswith("colours too pure for a screen, shown greyer: Rec.709 ")
        and f"p95 {blaze['Rec.709'].p95:.1f}" in line
    )
    assert is_shown(record) and is_shown({})


@pytest.mark.parametrize(
    "record", [None, [], {"sRGB": {"outside": 0, "p50": 0, "p95": 0}}, {"Rec.709": {"outside": 0.1}}, {"Rec.709": 3}]
)
def test_other_records_are_refused(record):
    assert not is_shown(record)
