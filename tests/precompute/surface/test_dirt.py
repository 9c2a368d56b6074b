# SPDX-License-Identifier: GPL-3.0-or-later
"""Dust, scars and spikes are judged by height as well as area, and no advised step removes the grating."""

import re

import numpy as np
import pytest

from precompute.surface.height_map import HeightMap
from precompute.surface.quality import describe
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.steps.pipeline import level, parse_steps

PIXEL = 50e-9


def scan(height):
    rough = 0.3e-9 * np.random.default_rng(0).standard_normal(height.shape)
    return HeightMap(height + rough, (PIXEL, PIXEL), "scan")


def lines(count=256):
    """A grating of 1 um, 80 nm high, across the rows."""
    return np.tile(40e-9 * np.sin(2 * np.pi * np.arange(count) * PIXEL / 1e-6), (count, 1))


def broken_ridges(count=256):
    """Ridges along the rows, 1 um apart, 60 nm high, two rows wide and broken into pieces of 2 to 5 um."""
    rng = np.random.default_rng(1)
    height = np.zeros((count, count))
    for row in range(8, count - 2, 20):
        edges = np.cumsum(rng.integers(40, 100, 12)) - rng.integers(0, 80)
        for start, stop in zip(edges[::2], edges[1::2], strict=True):
            height[row : row + 2, max(0, start) : max(0, stop)] = 60e-9
    return height


def finding(height_map):
    return next(each for each in describe(height_map).quality.findings if each.topic == "dirt")


def advised(sentence):
    """The steps of an advice; "" if it has none."""
    found = re.search(r"bake it with --level ([\w,:]+)", sentence)
    return found[1] if found else ""


def test_broken_ridges_along_the_rows_are_no_dirt():
    """They look like scars, but are the whole grating."""
    ridges = scan(broken_ridges())
    assert describe(ridges).periods_m[0] == pytest.approx(1e-6, rel=0.01)
    found = finding(ridges)
    assert found.light == "good" and advised(found.sentence) == ""
    assert found.sentence == "nothing is seen; leave out the steps scars and lines, each of which removes the grating"
    (told,) = level(ridges, parse_steps("scars")).told
    assert told.startswith("warning: scars:1: ") and "weakens the main peak of the grating" in told


def test_shifted_rows_are_aligned_and_no_scars():
    """Of 256 rows, 17 are shifted. Less than 3 nm changes no colour. The advice does not come back once it is taken."""
    for shift_nm, advice in ((0.8, ""), (5, "plane,lines")):
        height = lines()
        height[5::15] += shift_nm * 1e-9
        assert advised(finding(scan(height)).sentence) == advice
        aligned = level(scan(height), parse_steps("plane,lines")).height_map
        assert finding(aligned).sentence == "nothing is seen"
    height = lines()
    height[5::15, 40:100] += 5e-9
    assert advised(finding(scan(height)).sentence) == "plane,scars"


def test_small_pits_are_no_dirt():
    """The pits cover 3.5 % of the scan and are its grating."""
    y, x = np.indices((256, 256))
    found = finding(scan(-100e-9 * ((x % 16 < 3) & (y % 16 < 3))))
    assert found.light == "good" and advised(found.sentence) == ""
    assert found.sentence == "nothing is seen; leave out the step dust, which removes the grating"


def test_the_advice_against_dust_keeps_all_waves():
    """Under the dust only one of the two waves is detected."""
    crossed = lines() + 0.6 * lines().T
    clean = describe(scan(crossed)).waves.gratings
    y, x = np.indices(crossed.shape)
    rng = np.random.default_rng(3)
    for row, col in rng.integers(10, 246, (12, 2)):
        crossed[np.hypot(y - row, x - col) < 5] += 500e-9
    dusty = scan(crossed)
    steps = advised(finding(dusty).sentence)
    assert steps == "plane,dust"
    cleaned = level(dusty, parse_steps(steps))
    assert not any(line.startswith("warning") for line in cleaned.told)
    # Holes on 2 % of the scan cost 2 % of the amplitude.
    found = describe(cleaned.height_map).waves.gratings
    assert [wave.amplitude_m for wave in found] == pytest.approx([wave.amplitude_m for wave in clean], rel=0.02)
    assert len(found) == 2


@pytest.mark.parametrize(("height_nm", "light"), [(60, "good"), (200, "usable"), (1000, "poor")])
def test_four_high_pixels_are_told(height_nm, light):
    """The relief is 81 nm high: 1 um is more than ten times that, 200 nm more than once, 60 nm less."""
    height = lines()
    height[100:102, 200:202] += 40e-9 + height_nm * 1e-9
    found = finding(scan(height))
    assert found.light == light
    if light != "good":
        assert found.sentence.startswith("dust or a spike stands ") and " off the relief of 8" in found.sentence
        assert advised(found.sentence) == "plane,dust"
        cleaned = level(scan(height), parse_steps("plane,dust")).height_map
        assert np.nanmax(cleaned.height_m) < 45e-9
        assert finding(cleaned).light == "good"


def test_two_pixels_between_those_that_are_looked_at_are_told():
    """At 600 pixels a side only every second pixel is sampled."""
    height = lines(600)
    height[301, 401:404:2] -= 500e-9
    found = finding(scan(height))
    assert found.light == "usable" and found.sentence.startswith("dust or a spike stands 4")
    assert advised(found.sentence) == "plane,dust"


def test_a_spike_on_pits_is_removed_without_the_pits():
    y, x = np.indices((256, 256))
    pits = -100e-9 * ((x % 16 < 3) & (y % 16 < 3))
    pits[108, 110] += 900e-9
    found = finding(scan(pits))
    assert found.light == "usable" and advised(found.sentence) == "plane,outliers"
    assert not any(line.startswith("warning") for line in level(scan(pits), parse_steps("plane,outliers")).told)


def test_a_made_surface_is_not_asked_for_dirt():
    made = HeightMap(broken_ridges(), (PIXEL, PIXEL), "made", periodic=True)
    assert "dirt" not in [each.topic for each in describe(made).quality.findings]


def test_the_advice_for_the_real_skins_keeps_their_waves(shared_data):
    path = str(shared_data / "snake" / "xenopeltis_65um.png")
    skin = read_height_map(path, size_um=65, height_nm=818.69)
    steps = advised(finding(skin).sentence)
    assert steps == "plane,dust"
    assert not any(line.startswith("warning") for line in level(skin, parse_steps(steps)).told)
