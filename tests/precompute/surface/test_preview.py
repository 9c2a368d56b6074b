# SPDX-License-Identifier: GPL-3.0-or-later
"""The effect of levelling on a scan, as the panel shows it."""

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.height_map import HeightMap
from precompute.surface.preview import SIDE_MAX, look, preview, thinned
from precompute.surface.steps.pipeline import parse_steps

PIXEL = 50e-9


def scan(rows=256, cols=256, *, tilt_m=0.0, dust=False):
    """A wave of 800 nm along the scan's x axis, 20 nm in amplitude, symmetric about the middle so that it has no tilt;
    with a tilt along the y axis and a fleck of dust."""
    y, x = np.mgrid[:rows, :cols]
    height = 20e-9 * np.cos(2 * np.pi * (x - (cols - 1) / 2) * PIXEL / 800e-9) + tilt_m * y / (rows - 1)
    if dust:
        height[100:110, 60:70] += 300e-9
    return HeightMap(height, (PIXEL, PIXEL), "test")


def test_the_figures_are_those_before_and_after():
    """At 16 pixels a period the pixels beside a top are half a pixel off it. Over whole periods the rms is 20 nm / sqrt
    2. The tilt adds 500 nm to the range, and the variance of n even steps, (500 nm)^2 / 12 (n + 1) / (n - 1)."""
    found = preview(scan(tilt_m=500e-9), parse_steps("plane"))
    height = 40e-9 * np.cos(np.pi / 16)
    assert found.after.range_m == pytest.approx(height, rel=1e-9)
    assert found.after.rms_m == pytest.approx(20e-9 / np.sqrt(2), rel=1e-9)
    assert found.before.range_m == pytest.approx(500e-9 + height, rel=1e-9)
    variance = (20e-9) ** 2 / 2 + (500e-9) ** 2 / 12 * 257 / 255
    assert found.before.rms_m == pytest.approx(np.sqrt(variance), rel=1e-9)
    # A wave that does not fit the window is measured to a thousandth.
    assert found.before.wave.period_m == pytest.approx(800e-9, rel=1e-3)
    assert found.after.in_words() == ("range 39.23 nm", "rms 14.14 nm", "800 nm at 0 deg")


def test_what_steps_tell_and_take_out_is_shown():
    found = preview(scan(dust=True), parse_steps("plane,dust"))
    (told,) = found.told
    assert "dust:5: 0.21% of the pixels become holes" in told
    red = found.after.picture[..., 0] > found.after.picture[..., 1] + 0.5
    assert red[102:108, 62:68].all() and not red[:90].any()
    assert not (found.before.picture[..., 0] > found.before.picture[..., 1]).any()


def test_line_alignment_warns():
    along = scan()
    lines = HeightMap(along.height_m.T, along.pixel_size_m, "test")
    (told,) = preview(lines, parse_steps("lines")).told
    assert told.startswith("warning: lines: weakens the main peak")


def test_the_first_row_of_the_picture_is_the_scans_and_high_is_bright():
    height = np.zeros((64, 64))
    height[:8] = 1e-7
    picture = look(HeightMap(height, (PIXEL, PIXEL), "test")).picture
    assert picture.shape == (64, 64, 3)
    assert (picture[:8] == 1).all() and (picture[8:] == 0).all()


@pytest.mark.parametrize("shape", [(1, 64), (64, 1), (3, 2000), (700, 500)])
def test_scans_of_all_shapes_have_pictures(shape):
    picture = look(HeightMap(np.random.default_rng(0).normal(0, 1e-8, shape), (PIXEL, PIXEL), "test")).picture
    assert max(picture.shape) <= 256 and min(picture.shape[:2]) >= 1
    assert np.isfinite(picture).all() and picture.min() >= 0 and picture.max() <= 1


def test_a_flat_surface_has_no_period():
    assert look(HeightMap(np.zeros((64, 64)), (PIXEL, PIXEL), "test")).in_words()[2] == "no period"


def test_a_large_scan_is_thinned_and_a_small_one_is_not():
    small, large = scan(), scan(SIDE_MAX + 1, 700)
    assert thinned(small) is small
    thin = thinned(large)
    assert thin.pixel_size_m == (2 * PIXEL, 2 * PIXEL)
    assert np.array_equal(thin.height_m, large.height_m[::2, ::2])
    assert thin.height_m.base is None or thin.height_m.base.size == thin.height_m.size


def test_a_thinned_surface_wraps_only_where_whole_periods_are_left():
    for rows, wraps in ((2 * SIDE_MAX, True), (2 * SIDE_MAX - 1, False)):
        made = HeightMap(np.zeros((rows, 4)), (PIXEL, PIXEL), "test", periodic=True)
        assert thinned(made).periodic is wraps


def test_a_step_that_does_not_fit_is_told():
    with pytest.raises(GratingError, match="crop: no pixel is between"):
        preview(scan(), parse_steps("crop:100:100:110:110"))
