# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps that turn, crop and mask."""

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.quality import describe

from .conftest import wave

PIXEL = (50e-9, 50e-9)


@pytest.mark.parametrize("degrees", [-100, -45, -10, 7.5, 30, 60, 200])
def test_a_turned_grating_turns_counterclockwise(levelled, degrees):
    """On pixels that are not square. At 16 pixels a period, cubic convolution has an error of at most (2
    pi / 16)^3 / 6 = 1 % of the amplitude."""
    pixel = (40e-9, 50e-9)
    turned, height_map, _ = levelled(wave((160, 128), pixel), f"rotate:{degrees}", pixel=pixel)
    grating = describe(height_map).waves.gratings[0]
    off = (grating.angle_deg - degrees + 90) % 180 - 90
    assert abs(off) < 1
    assert grating.period_m == pytest.approx(800e-9, rel=0.01)
    assert np.abs(turned).max() == pytest.approx(50e-9, rel=0.01)
    assert height_map.pixel_size_m == pixel


def test_a_turned_surface_is_the_surface_between_its_pixels(levelled):
    """A surface of the second degree, which cubic convolution reads exactly, turned about the scan's middle."""
    rows, cols = 65, 81
    y, x = -(np.arange(rows)[:, None] - 32) * 50e-9, (np.arange(cols) - 40) * 50e-9
    shape = lambda t, b: 3e-2 * t + 2e4 * t * b - 1e4 * b * b  # noqa: E731
    turned, _, _ = levelled(shape(x, y), "rotate:25")
    cos, sin = np.cos(np.radians(25)), np.sin(np.radians(25))
    y, x = (-(np.arange(turned.shape[0])[:, None] - (turned.shape[0] - 1) / 2) * 50e-9,
            (np.arange(turned.shape[1]) - (turned.shape[1] - 1) / 2) * 50e-9)  # fmt: skip
    # Turning (x, y) back gives the original place.
    exact = shape(x * cos + y * sin, y * cos - x * sin)
    inner = slice(1, -1)  # the corners touch the scan's rim, where a pixel is repeated
    np.testing.assert_allclose(turned[inner, inner], exact[inner, inner], atol=1e-6 * np.ptp(exact))


@pytest.mark.parametrize("quarters", [1, -1, 2, 0])
def test_quarters_of_a_turn_move_pixels(levelled, quarters):
    height = wave((20, 30), angle_deg=20)
    height[3, 4] = np.nan
    turned, height_map, told = levelled(height, f"rotate:{90 * quarters}", pixel=(10e-9, 20e-9), periodic=True)
    np.testing.assert_array_equal(turned, np.rot90(height, quarters))
    assert height_map.pixel_size_m == ((10e-9, 20e-9) if quarters % 2 == 0 else (20e-9, 10e-9))
    assert height_map.periodic and told == ()


def test_what_is_too_small_to_turn_is_refused(levelled):
    with pytest.raises(GratingError, match="scan: rotate leaves 5 x 5 pixels; give a larger scan"):
        levelled(wave((8, 8)), "rotate:45")


def test_crop_keeps_the_pixels_whose_middles_lie_inside(levelled):
    """In micrometres from the left and upper edge, on pixels of 50 nm by 100 nm."""
    height = wave((40, 60), angle_deg=20)
    cut, height_map, _ = levelled(height, "crop:0.5:0.2:2.5:1.4", pixel=(50e-9, 100e-9))
    np.testing.assert_array_equal(cut, height[4:28, 5:25])
    assert height_map.pixel_size_m == (50e-9, 100e-9)
    np.testing.assert_array_equal(levelled(height, "crop:0:0:1e3:1e3")[0], height)


def test_a_mask_is_a_hole(levelled):
    height = wave((40, 60))
    masked, _, _ = levelled(height, "mask:0.5:1:1:1.5")
    hole = np.zeros((40, 60), bool)
    hole[20:30, 10:20] = True
    np.testing.assert_array_equal(np.isnan(masked), hole)
    np.testing.assert_array_equal(masked[~hole], height[~hole])


@pytest.mark.parametrize(("text", "fault"), [
    ("crop:2:0:1:1", "no pixel is between 2 and 1 um; give LEFT:TOP:RIGHT:BOTTOM within the 3 x 2 um"),
    ("crop:5:0:6:1", "no pixel is between 5 and 6"), ("mask:0:1:1:1", "no pixel is between 1 and 1"),
    ("crop:0:0:0.2:1", "crop leaves 4 x 20 pixels"), ("mask:0:0:9:9", "mask leaves no height"),
    ("mask:0:0:1.5:2,crop:0:0:1:1", "crop leaves no height"),
])  # fmt: skip
def test_parts_that_are_none_are_refused(levelled, text, fault):
    with pytest.raises(GratingError, match=f"^scan: .*{fault}"):
        levelled(wave((40, 60)), text)


def test_whole_periods_are_kept_from_the_middle(levelled):
    """Along T, 16 pixels a period: 128 of 128 + 9 pixels are kept. Along B at 45 degrees, 22.6 pixels a period: five
    of the 5.7 periods in 128 pixels."""
    cut, _, told = levelled(wave((64, 137)), "periods")
    assert cut.shape == (64, 128) and told == ("periods: 128 x 64 of 137 x 64 pixels are kept",)
    np.testing.assert_array_equal(cut, wave((64, 137))[:, 4:132])
    assert levelled(wave((128, 128), angle_deg=45), "periods")[0].shape == (113, 113)


def test_without_a_grating_there_are_no_whole_periods(levelled):
    with pytest.raises(GratingError, match="scan: periods: no grating stands out of the scan; leave periods out"):
        levelled(1e-9 * np.random.default_rng(0).standard_normal((64, 64)), "periods")
