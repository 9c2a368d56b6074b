# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of spectra in a renderer's space."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from precompute.colour.observer import observer, white_xyz
from precompute.colour.spaces import RGB_SPACES, rgb_from_xyz, shown_rgb

# Light of one wavelength, which lies outside of every space.
LINES = observer(np.array([450e-9, 520e-9, 560e-9, 620e-9]), "E")
LINES = 0.3 * LINES / LINES[:, 1:2]


@pytest.mark.parametrize("space", RGB_SPACES)
def test_a_colour_outside_keeps_its_luminance_and_hue_and_comes_inside(space):
    to_rgb = rgb_from_xyz(space)
    before = LINES @ to_rgb.T
    outside = before.min(axis=1) < 0
    assert outside.sum() >= 2
    before, after = before[outside], shown_rgb(LINES[outside], to_rgb)
    np.testing.assert_allclose(after @ np.linalg.inv(to_rgb)[1], 0.3, rtol=1e-12)
    np.testing.assert_allclose(after.min(axis=1), 0, atol=1e-12)
    # On the line from the grey to the colour.
    np.testing.assert_allclose(np.cross(after - 0.3, before - 0.3), 0, atol=1e-12)


@pytest.mark.parametrize("space", RGB_SPACES)
def test_a_colour_inside_stays(space):
    grey = 0.3 * white_xyz()
    np.testing.assert_allclose(shown_rgb(grey, rgb_from_xyz(space)), 0.3, rtol=1e-12)


def test_what_has_no_luminance_is_black():
    """Rounding of a table in the dark leaves such colours."""
    dark = np.array([[0, 0, 0], [1e-9, -1e-12, 0], [0, 0, 1e-9], [-1.0, 0, -1.0]])
    np.testing.assert_array_equal(shown_rgb(dark, rgb_from_xyz()), 0)


@given(arrays(float, (5, 3), elements=st.floats(-1e6, 1e6)))
def test_nothing_is_negative_or_brighter_than_its_luminance(xyz):
    to_rgb = rgb_from_xyz()
    rgb = shown_rgb(xyz, to_rgb)
    assert (rgb >= 0).all()
    # Sums of three products, each up to 3.3 times the largest component.
    rounding = 100 * np.finfo(float).eps * np.abs(xyz).max()
    np.testing.assert_allclose(rgb @ np.linalg.inv(to_rgb)[1], np.maximum(xyz[:, 1], 0), rtol=1e-9, atol=rounding)
