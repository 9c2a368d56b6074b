# SPDX-License-Identifier: GPL-3.0-or-later
"""Line alignment, and its effect on a grating with lines along the scan's x axis."""

import re

import numpy as np
import pytest

from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.steps.pipeline import level, parse_steps

from .conftest import wave

BY = pytest.mark.parametrize("text", ["lines", "lines:difference"])


@BY
def test_rows_that_were_shifted_are_put_back(levelled, text):
    """The microscope's shifts between lines, on a grating across the lines, which stays. With 256 pixels and 16 whole
    periods each row has the same median and the same mean of differences, 0."""
    clean = wave((64, 256))
    shifted = clean + np.random.default_rng(0).normal(0, 100e-9, 64)[:, None]
    aligned, _, told = levelled(shifted, text)
    # The shifts are found to rounding. From differences they are found up to one tilt, the mean of the differences.
    left = aligned - clean
    rows = np.arange(64)
    trend = np.polyval(np.polyfit(rows, left.mean(axis=1), 1), rows) if "diff" in text else left.mean()
    assert np.abs(left.mean(axis=1) - trend).max() < 1e-9
    assert np.abs(left - left.mean(axis=1)[:, None]).max() < 1e-20
    assert told == ()


def test_a_row_without_heights_stays_one(levelled):
    height = wave((64, 128))
    height[10] = np.nan
    for text in ("lines", "lines:difference"):
        aligned, _, _ = levelled(height, text)
        np.testing.assert_array_equal(np.isnan(aligned), np.isnan(height))


def test_medians_of_coarse_heights_do_not_add_up(levelled):
    """Gentle rises and steep falls along B, in steps of 3 nm: the median of the differences sees only the rises."""
    rows = np.arange(300)
    saw = 100e-9 * (rows % 20 / 20)[:, None] + 30e-9 * np.sin(np.arange(256) / 7)
    aligned, _, _ = levelled(np.round(saw / 3e-9) * 3e-9, "lines:difference")
    assert np.ptp(aligned) < 300e-9  # and 300 rows of 5 nm would be 1500 nm


def test_differences_keep_the_mean_step_between_rows(levelled):
    """A scan's tilt along B is the surface's, and the step `plane` takes it out."""
    tilted = wave((64, 128)) + 5e-9 * np.arange(64)[:, None]
    aligned, _, _ = levelled(tilted, "lines:difference")
    np.testing.assert_allclose(aligned, tilted, rtol=0, atol=1e-20)


@BY
def test_a_grating_along_the_rows_is_warned_of(levelled, text):
    _, _, told = levelled(wave(angle_deg=90), f"plane,{text}")
    assert len(told) == 1
    assert told[0] == (
        f"warning: {text}: weakens the main peak of the grating (800 nm at 90 deg) by 100%; leave this step out to "
        "keep the colours"
    )


@BY
@pytest.mark.parametrize("amplitude", [45e-9, 15e-9])
def test_the_weaker_wave_of_a_crossed_grating_is_warned_of(levelled, text, amplitude):
    """It sends out 81 % or 9 % of the other wave's light; the other wave stays unchanged."""
    height = wave() + wave(angle_deg=90, amplitude=amplitude)
    (told,) = levelled(height, f"plane,{text}")[2]
    assert told.startswith(f"warning: {text}: weakens fainter waves of the grating (800 nm at 90 deg by 100%); leave")


@BY
def test_a_wave_of_a_hundredth_of_the_light_is_not_warned_of(levelled, text):
    height = wave(amplitude=50e-9) + wave(angle_deg=90, amplitude=5e-9)
    assert levelled(height, text)[2] == ()


def test_the_real_grid_along_the_rows(shared_data):
    """The grid's lines run at 45 degrees. Turned along the rows, they are erased by alignment, which warns."""
    grid = read_height_map(str(shared_data / "nanosurf" / "grid.nid"))
    turned = level(grid, parse_steps("plane,rotate:45")).height_map
    plane = level(turned, parse_steps("plane")).height_map
    rms = np.std(turned.height_m)
    assert np.std(plane.height_m) == pytest.approx(rms, rel=0.01)
    for text in ("lines", "lines:difference"):
        aligned = level(plane, parse_steps(text))
        (told,) = aligned.told
        warning = rf"warning: {text}: weakens the main peak of the grating \(316.6 nm at -89 deg\) by (\d+)%;"
        loss = re.match(warning, told)
        assert loss and int(loss[1]) >= 99
        assert np.std(level(aligned.height_map).height_map.height_m) < 0.2 * rms
