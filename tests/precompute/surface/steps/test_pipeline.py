# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps as text, and their order."""

import numpy as np
import pytest

from devtools import ROOT
from precompute.base.failure import GratingError
from precompute.surface.height_map import level_plane
from precompute.surface.relief import prepare
from precompute.surface.steps.pipeline import DEFAULT, KINDS, help_text, level, parse_steps, steps_of

from .conftest import wave

SOME = ("plane", "plane:robust", "poly:3", "lines", "lines:difference", "scars:1.5", "rotate:-12.5", "crop:0:1.5:2:30",
        "fill", "periods", "calibrate:316.2", "tip:20")  # fmt: skip


def test_a_step_comes_back_from_its_text():
    steps = parse_steps(",".join(SOME))
    assert tuple(step.text for step in steps) == SOME
    assert steps_of([step.text for step in steps], "test") == steps


def test_each_number_is_written_and_each_word_only_where_it_is_not_the_default():
    texts = [step.text for step in parse_steps("dust,poly:2.0,rotate:12.50,plane:least-squares,lines:median,scars:1e0")]
    assert texts == ["dust:5", "poly:2", "rotate:12.5", "plane", "lines", "scars:1"]
    assert parse_steps("dust") == parse_steps("dust:5.0")
    assert parse_steps("none") == ()


@pytest.mark.parametrize(("text", "fault"), [
    ("", "give one of plane, poly"), ("plain", "give one of plane"), ("plane,,dust", "give one of plane"),
    ("none,plane", "give one of plane"), ("Plane", "give one of"), ("plane:tilted", "one of least-squares, robust"),
    ("plane:robust:2", "2 arguments; give at most 1"), ("invert:1", "1 arguments; give none"),
    ("rotate", "give DEG, a number from -360 to 360, as rotate:DEG"), ("rotate:", "give DEG"),
    ("rotate:nan", "give DEG"), ("rotate:inf", "give DEG"), ("rotate:1e99", "give DEG"), ("rotate:1_0", "give DEG"),
    ("rotate:" + "1" * 5000, "give DEG"), ("rotate:1e", "give DEG"), ("rotate: 1", "give DEG"), ("poly:0", "give DEG"),
    ("poly:1.5", "a whole number from 1 to 5"), ("poly:6", "a whole number"), ("crop:1:2:3", "give BOTTOM"),
    ("crop:1:2:-3:4", "give RIGHT"), ("zscale:0", "FACTOR"), ("tip", "give NM"),
    (",".join(["plane"] * 51), "at most 50"),
])  # fmt: skip
def test_what_is_no_step_is_refused(text, fault):
    with pytest.raises(GratingError, match="^asked: .*; ") as caught:
        parse_steps(text, "asked")
    assert fault in str(caught.value) and len(str(caught.value)) < 300


@pytest.mark.parametrize("text", [None, 3, ["plane"], {"plane": 1}, True])
def test_what_is_no_text_is_no_step(text):
    with pytest.raises(GratingError, match="asked: no such step; give one of"):
        steps_of([text], "asked")


def test_the_help_names_every_step_and_its_form():
    assert all(f"{kind.form}: " in help_text() for kind in KINDS.values())
    assert KINDS["crop"].form == "crop:LEFT:TOP:RIGHT:BOTTOM" and KINDS["dust"].form == "dust[:K]"


def test_the_page_of_scans_has_every_step():
    page = (ROOT / "docs" / "scans.md").read_text(encoding="utf-8")
    assert all(f"| `{kind.form.replace('|', ' or ')}` | {kind.help} |" in page for kind in KINDS.values())


def test_the_order_counts(levelled):
    """A levelled plane is tilted again if heights on one side are removed."""
    height = wave() + 2e-9 * np.arange(128)
    first, _, _ = levelled(height, "plane,mask:0:0:3:3")
    last, _, _ = levelled(height, "mask:0:0:3:3,plane")
    assert np.isnan(first).sum() == np.isnan(last).sum() == 3600
    assert np.nanmax(np.abs(first - last)) > 1e-10


def test_a_step_tells_by_its_text(levelled):
    _, _, told = levelled(wave(), "plane,dust,fill,rotate:30")
    assert told == ("dust:5: nothing found", "rotate:30: 93 x 93 of 128 x 128 pixels are kept")


def test_without_steps_a_relief_is_what_it_was_before_there_were_any(levelled):
    height = wave(angle_deg=20) + 3e-9 * np.arange(128)
    height[3:9, 7:30] = np.nan
    _, given, _ = levelled(height, "none")
    plane = level_plane(given).height_m
    np.testing.assert_array_equal(level(given, DEFAULT).height_map.height_m, plane)
    np.testing.assert_array_equal(prepare(given).height_m, prepare(given, parse_steps("plane")).height_m)
    assert prepare(given, ()).height_range_m > prepare(given).height_range_m + 300e-9


def test_a_periodic_surface_keeps_its_heights_to_the_bit(levelled):
    ramp = np.arange(64.0)[None, :] * 1e-9 + np.zeros((8, 1))
    height, height_map, _ = levelled(ramp, "plane", periodic=True)
    np.testing.assert_array_equal(height, ramp)
    assert height_map.periodic


@pytest.mark.parametrize("text", ["poly", "lines", "crop:0:0:3:3", "rotate:10", "tip:20"])
def test_a_surface_that_is_cut_or_bent_wraps_no_more(levelled, text):
    assert not levelled(wave(), text, periodic=True)[1].periodic


def test_fill(levelled):
    height = wave()
    height[5:7, 5:9] = np.nan
    filled, _, _ = levelled(height, "fill")
    assert np.isfinite(filled).all()
    np.testing.assert_array_equal(filled[np.isfinite(height)], height[np.isfinite(height)])


def test_a_scan_of_hardly_any_points_is_a_warning(levelled):
    """Whether they are filled by a step or later. A few missing points, or a crop without any, are no reason."""
    height = wave()
    height[:-1] = np.nan
    for steps in ("plane", "plane,fill", "fill"):
        (told,) = levelled(height, steps)[2]
        assert told.startswith("warning: ") and told.endswith(
            "99.22% of the points are missing and filled in; scan again, or crop to the measured part"
        )
    height = wave()
    height[:, :25] = np.nan
    assert levelled(height, "plane")[2] == levelled(height, "crop:1.5:0:6.4:6.4")[2] == ()
