# SPDX-License-Identifier: GPL-3.0-or-later
"""The mappings of colours into a space, and the search for the nearest colour."""

import numpy as np
import pytest

from laboratory.benchmarks import gamut
from precompute.colour.observer import observer, white_xyz
from precompute.colour.working_space import RGB_SPACES, rgb_from_xyz

# Light of one wavelength, which lies outside of every space, and a grey, which lies inside.
LINES = observer(np.array([450e-9, 520e-9, 560e-9, 620e-9]), "E")
LINES = gamut.SHOWN_Y * LINES / LINES[:, 1:2]
GREY = gamut.SHOWN_Y * white_xyz()[None]


@pytest.mark.parametrize("space", RGB_SPACES)
def test_towards_grey_keeps_luminance_and_hue_and_is_inside(space):
    to_rgb = rgb_from_xyz(space)
    luminance = np.linalg.inv(to_rgb)[1]
    rgb = LINES @ to_rgb.T
    rgb = rgb[rgb.min(axis=1) < 0]
    assert len(rgb) >= 2
    mapped = gamut.towards_grey(rgb, luminance)
    np.testing.assert_allclose(mapped @ luminance, gamut.SHOWN_Y, rtol=1e-12)
    np.testing.assert_allclose(mapped.min(axis=1), 0, atol=1e-12)
    # On the line from the grey to the colour.
    away, before = mapped - gamut.SHOWN_Y, rgb - gamut.SHOWN_Y
    np.testing.assert_allclose(np.cross(away, before), 0, atol=1e-12)
    assert ((gamut.cut(rgb) @ luminance) > gamut.SHOWN_Y).all()


def test_colours_inside_stay_and_cost_nothing():
    to_rgb = rgb_from_xyz("Rec.709")
    np.testing.assert_allclose(gamut.towards_grey(GREY @ to_rgb.T, np.linalg.inv(to_rgb)[1]), GREY @ to_rgb.T)
    assert gamut.nearest(GREY, to_rgb) == pytest.approx(0, abs=1e-6)


def test_the_search_is_at_least_as_good_as_the_mappings():
    row = gamut.row_of("lines", LINES, "Rec.709")
    assert row.outside == 1 and row.light > 1
    for one, least in zip(row.cut, row.least, strict=True):
        assert 0 < least <= one
