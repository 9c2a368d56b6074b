# SPDX-License-Identifier: GPL-3.0-or-later
"""The arguments with which the panel adds a step."""

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.height_map import HeightMap
from precompute.surface.steps.pipeline import KINDS, first_step, level

PIXEL = 50e-9
WAVES = HeightMap(20e-9 * np.sin(2 * np.pi * np.arange(128) / 16) * np.ones((64, 1)), (PIXEL, PIXEL), "test")


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_can_be_added(name):
    level(WAVES, [first_step(name, WAVES)])


@pytest.mark.parametrize(("name", "text"), [
    ("dust", "dust:5"), ("plane", "plane"), ("rotate", "rotate:0"), ("crop", "crop:0:0:6.4:3.2"),
    ("zscale", "zscale:1"), ("mask", "mask:2.88:1.44:3.52:1.76"),
])  # fmt: skip
def test_the_first_arguments(name, text):
    assert first_step(name, WAVES).text == text


@pytest.mark.parametrize("name", ["rotate", "crop", "zscale"])
def test_what_must_be_given_changes_nothing_as_yet(name):
    levelled = level(WAVES, [first_step(name, WAVES)]).height_map
    assert np.array_equal(levelled.height_m, WAVES.height_m)


def test_calibration_begins_with_the_period_that_the_scan_has():
    assert first_step("calibrate", WAVES).values[0] == pytest.approx(800, rel=1e-3)
    with pytest.raises(GratingError, match="flat: calibrate: no grating stands out"):
        first_step("calibrate", HeightMap(np.zeros((64, 64)), (PIXEL, PIXEL), "flat"))
