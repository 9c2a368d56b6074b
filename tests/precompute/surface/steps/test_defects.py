# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps against scars, outliers and dust find what was added, and nothing else."""

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.steps.pipeline import level, parse_steps

from .conftest import wave

GRATINGS = [wave(angle_deg=angle) for angle in (0, 45, 90)] + [np.sign(wave(angle_deg=30)) * 30e-9]


def rough(height, nm=1.0):
    return height + nm * 1e-9 * np.random.default_rng(4).standard_normal(height.shape)


@pytest.mark.parametrize("text", ["scars", "outliers", "dust"])
@pytest.mark.parametrize("height", GRATINGS)
def test_nothing_is_found_on_clean_gratings(levelled, height, text):
    assert levelled(height, text)[2] == (f"{parse_steps(text)[0].text}: nothing found",)
    assert levelled(rough(height), text)[2] == (f"{parse_steps(text)[0].text}: nothing found",)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("wide", [1, 2, 4])
def test_scars_are_found_to_the_pixel(levelled, wide, sign):
    """A step of 150 nm is several times the grating's greatest row difference, 50 nm * 2 pi / 16 = 20 nm."""
    height = rough(wave(angle_deg=60))
    height[100 : 100 + wide, 90:115] += sign * 150e-9
    height[90, 5:20] += sign * 150e-9  # a run of 15 pixels is too short for a scar
    found, _, (told,) = levelled(height, "scars")
    expected = np.zeros((128, 128), bool)
    expected[100 : 100 + wide, 90:115] = True
    np.testing.assert_array_equal(np.isnan(found), expected)
    assert told == f"scars:1: {expected.mean():.2%} of the pixels become holes, which are filled"


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_scans_too_low_for_scars(levelled, rows):
    assert levelled(rough(wave((rows, 64))), "scars")[2] == ("scars:1: nothing found",)


def test_outliers_are_single_pixels(levelled):
    """Spikes up and down, at the rim and beside a hole; two pixels side by side count as dust."""
    height = rough(wave(angle_deg=20))
    height[60, 60] = np.nan
    places = [(0, 0), (20, 30), (61, 61), (127, 64)]
    for number, place in enumerate(places):
        height[place] += (-1) ** number * 200e-9
    height[100, 100:102] += 200e-9
    found, _, _ = levelled(height, "outliers")
    assert sorted(zip(*np.nonzero(np.isnan(found)), strict=True)) == sorted([*places, (60, 60)])


def test_dust_and_a_scratch_are_found_over_waviness(levelled):
    """The relief's robust deviation is 1.48 * 35 nm = 52 nm: dust of 400 nm is 7 times as high, anywhere on a wave of
    300 nm that the background follows. A scratch of that depth is found too."""
    y, x = np.indices((256, 256))
    shape = wave((256, 256)) + 150e-9 * np.sin(2 * np.pi * (x + y) / 256)
    dirt = (np.hypot(y - 100, x - 60) < 6) | (np.hypot(y - 30, x - 200) < 4)
    scratch = (np.abs(y - 180) < 2) & (x > 100) & (x < 180)
    found, _, _ = levelled(rough(shape + 450e-9 * dirt - 450e-9 * scratch), "dust")
    holes = np.isnan(found)
    assert holes[dirt | scratch].all()
    # One pixel is removed around each: a ring about the circles and the strip.
    assert holes.sum() < 1.8 * (dirt | scratch).sum()


def test_holes_in_a_scan_are_no_dust(levelled):
    height = rough(wave())
    height[40:80, 40:80] = np.nan
    for text in ("scars", "outliers", "dust"):
        found, _, told = levelled(height, text)
        assert told[0].endswith("nothing found")
        np.testing.assert_array_equal(np.isnan(found), np.isnan(height))


def test_a_block_without_heights_takes_its_ground_from_others(levelled):
    height = rough(wave())
    height[:20, :20] = np.nan
    height[60:63, 60:63] += 500e-9
    found, _, _ = levelled(height, "dust")
    assert np.isnan(found[60:63, 60:63]).all() and np.isnan(found).sum() < 400 + 40


def test_the_relief_itself_is_no_dust(levelled):
    """Bumps on a sixth of a plane: the median plane has no relief, so all bumps would be removed."""
    y, x = np.indices((128, 128))
    bumps = 100e-9 * ((x % 16 < 6) & (y % 16 < 7))
    with pytest.raises(GratingError, match=r"scan: dust:5 would remove \d\d% of the scan.*; give dust a larger number"):
        levelled(bumps, "dust")


def test_pits_that_are_taken_for_dust_are_warned_of(levelled):
    """The pits cover 4 % of the scan and are its grating."""
    y, x = np.indices((128, 128))
    pits = -100e-9 * ((x % 16 < 3) & (y % 16 < 3))
    _, _, (told,) = levelled(rough(pits, 0.5), "dust:50")
    assert told.startswith("warning: dust:50: ") and "weakens the main peak of the grating (800" in told


def test_the_real_skins_lose_their_dust(shared_data):
    """The highest fleck of Xenopeltis is 530 nm above the mean; its fingers reach 219 nm."""
    scan = read_height_map(str(shared_data / "snake" / "xenopeltis_65um.png"), size_um=65, height_nm=818.69)
    clean = level(scan, parse_steps("plane,scars,dust"))
    height = clean.height_map.height_m
    assert 0.002 < np.isnan(height).mean() < 0.01
    assert np.nanmax(height) < 0.5 * np.max(level(scan).height_map.height_m)
    assert not any(line.startswith("warning") for line in clean.told)
