# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps for sign, scale and the tip."""

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.quality import describe

from .conftest import wave


def test_invert_and_zscale(levelled):
    height = wave()
    np.testing.assert_array_equal(levelled(height, "invert")[0], -height)
    np.testing.assert_array_equal(levelled(height, "zscale:1.5")[0], 1.5 * height)


def test_calibration_gives_the_grating_its_known_period(levelled):
    pixel = (40e-9, 50e-9)
    height = wave((160, 128), pixel, angle_deg=30)
    _, height_map, told = levelled(height, "calibrate:840", pixel=pixel)
    assert describe(height_map).periods_m[0] == pytest.approx(840e-9, rel=1e-9)
    assert height_map.pixel_size_m[0] / height_map.pixel_size_m[1] == pytest.approx(0.8, rel=1e-12)
    assert height_map.pixel_size_m[0] == pytest.approx(42e-9, rel=0.005)
    assert told[0].endswith("is now 840 nm: pixels are 1.05 times as large")


@pytest.mark.parametrize("period", [300, 420, 1590, 2000])
def test_another_grating_is_refused(levelled, period):
    """This includes harmonics, at a factor of nearly two."""
    with pytest.raises(GratingError, match=f"scan: calibrate: its grating measures .* nm, far from {period} nm; give"):
        levelled(wave(), f"calibrate:{period}")


@pytest.mark.parametrize(("period", "warned"), [(730, False), (870, False), (720, True), (890, True)])
def test_a_calibration_by_more_than_a_tenth_is_warned_of(levelled, period, warned):
    (told,) = levelled(wave(), f"calibrate:{period}")[2]
    assert told.startswith("warning: ") is warned
    assert told.endswith(f"check that this is the grating of {period} nm") is warned


@pytest.mark.parametrize("period", [1200, 7200])
def test_a_grating_is_calibrated_by_its_own_wave_and_not_by_a_stronger_harmonic(levelled, period):
    """The harmonic sends out more light. A wave of more than 6.7 um shows no colours, but its half does."""
    pixel = (period * 1e-9 / 32,) * 2
    height = wave(period=period * 1e-9, amplitude=20e-9, pixel=pixel) + wave(
        period=period * 0.5e-9, amplitude=15e-9 if period > 6700 else 40e-9, pixel=pixel
    )
    height_map, told = levelled(np.tile(height, (1, 2)), f"calibrate:{1.02 * period:g}", pixel=pixel)[1:]
    assert height_map.pixel_size_m[0] == pytest.approx(1.02 * pixel[0], rel=0.01) and "warning" not in told[0]


def dilated(height, radius, pixel):
    """The scan of a paraboloid tip: its highest apex over all surface points that it may touch."""
    reach = 24
    padded = np.pad(height, reach, mode="edge")
    rows, cols = height.shape
    return np.max([
        padded[reach + dy : reach + dy + rows, reach + dx : reach + dx + cols]
        - ((dy * pixel[0]) ** 2 + (dx * pixel[1]) ** 2) / (2 * radius)
        for dy in range(-reach, reach + 1) for dx in range(-reach, reach + 1)
    ], axis=0)  # fmt: skip


def test_the_tip_is_taken_out_where_it_touched(levelled):
    """The tip widens round bumps on pixels that are not square. Erosion restores the bumps where the tip reached the
    ground between them, and never goes below the surface."""
    pixel, radius = (5e-9, 4e-9), 30e-9
    y, x = np.indices((60, 80))
    surface = 20e-9 * np.exp(-(((y % 30 - 15) * 5e-9) ** 2 + ((x % 40 - 20) * 4e-9) ** 2) / (2 * (25e-9) ** 2))
    scanned = dilated(surface, radius, pixel)
    assert np.abs(scanned - surface).max() > 0.5e-9
    eroded, _, (told,) = levelled(scanned, "tip:30", pixel=pixel)
    # Without the rim, where the tip also touched what lies beyond it.
    inner = (slice(12, -12), slice(12, -12))
    assert (eroded >= surface - 1e-18)[inner].all()
    assert np.abs(eroded - surface)[inner].max() < 0.1 * np.abs(scanned - surface).max()
    assert "of the pixels are lowered, by up to" in told


def test_a_rounded_top_is_sharper_by_the_radius_of_the_tip(levelled):
    """A tip of 30 nm scans a ridge of radius 470 nm as one of 500 nm. The tip touches between pixels, at most 2.5 nm
    from one: (2.5 nm)^2 / 2 * (1 / 30 - 1 / 500) / nm = 0.1 nm."""
    x = (np.arange(100) - 50) * 5e-9
    eroded, _, _ = levelled(-(x**2) / (2 * 500e-9) + np.zeros((20, 1)), "tip:30", pixel=(5e-9, 5e-9))
    inner = slice(20, -20)
    np.testing.assert_allclose(eroded[:, inner], np.tile(-(x**2) / (2 * 470e-9), (20, 1))[:, inner], atol=0.1e-9)


def test_a_tip_changes_nothing_flat(levelled):
    assert levelled(np.full((20, 30), 7e-9), "tip:30")[2] == ("tip:30: no pixel is changed",)
