# SPDX-License-Identifier: GPL-3.0-or-later
"""The light that serves several lamps, the errors under others, and the table of lamps."""

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.colour.channels import (
    lamp_table,
    lamps_of_table,
    light_for,
    nearest_row,
    row_of,
    row_of_temperature,
    scene_matrix,
    stated_error,
)
from precompute.colour.illuminants import is_illuminant
from precompute.colour.spaces import RGB_SPACES, lamp_rgb

FILE = "440:0 450:1 460:0"


@pytest.mark.parametrize(
    ("lamps", "light"),
    [
        ([], "D65"),
        (["D65"], "D65"),
        (["2700K"], "D65+smooth"),
        (["A", "D5500"], "D65+smooth"),
        (["LED-B1"], "D65+led"),
        (["2700K", "LED-RGB1"], "D65+led"),
        (["FL11"], "D65+FL11"),
        (["FL11", "2700K", "532nm"], "D65+smooth+532nm+FL11"),
        ([FILE, "LED-B1"], f"D65+led+{FILE}"),
    ],
)
def test_a_light_serves_lamps(lamps, light):
    assert light_for(lamps) == light
    assert is_illuminant(light)


def test_more_lamps_than_have_room_are_refused():
    with pytest.raises(GratingError, match="a bake has colours of their own for 4 lamps; use fewer kinds of lamps"):
        light_for(["FL1", "FL2", "FL3", "HP1", "532nm"])


STATED = {"2000K": (7.0, 30.0), "4000K": (2.0, 6.0), "D5500": (0.5, 1.5), "LED-B1": (6.0, 19.0), "FL11": (5.0, 17.0)}


def test_the_error_under_a_lamp_is_that_of_its_kind():
    assert stated_error("LED-V1", "D65", STATED) == (6.0, 19.0)
    assert stated_error("HP1", "D65", STATED) == (5.0, 17.0)
    assert stated_error("D55", "D65", STATED) == (0.5, 1.5)
    assert stated_error("FL11", "D65+FL11", STATED) is None
    assert stated_error("2700K", "D65", {}) is None
    # 375 mireds are halfway between 500 and 250.
    assert stated_error("2667K", "D65", STATED) == pytest.approx((4.5, 18.0), abs=0.02)
    assert stated_error("1000K", "D65", STATED) == (7.0, 30.0)
    assert stated_error("20000K", "D65", STATED) == (2.0, 6.0)


def test_rows_are_those_of_their_lamps():
    lamps = lamps_of_table([FILE])
    for lamp in ("D65", "E", "A", "D50", "D75", "FL11", "LED-B1", "HP1", "400nm", "532nm", "700nm"):
        assert lamps[int(row_of(lamp))] == lamp
    assert lamps[int(row_of(FILE, [FILE]))] == FILE
    for kelvins in (1000, 1850, 2700, 4000, 6500, 10000, 25000):
        row = row_of(f"{kelvins}K")
        # Rows are a mired apart, of whole kelvins: a lamp is at most half a mired and half a kelvin from its own.
        assert 1e6 / int(lamps[int(row)][:-1]) == pytest.approx(1e6 / kelvins, abs=0.5 + 0.5e6 / kelvins**2 + 1e-9)
        assert lamps[int(row)].endswith("K")
        driven = eval(row_of_temperature(str(kelvins)), {"min": min, "max": max})  # noqa: S307  # a driver's expression
        assert round(driven) == row
    assert int(lamps[int(row_of("D5500"))][1:]) == pytest.approx(5500, abs=16)


def test_a_row_holds_its_lamp_s_matrix():
    for space in RGB_SPACES:
        table = lamp_table(space, "D65+smooth", [FILE])
        assert table.shape == (len(lamps_of_table([FILE])), 7, 3)
        for lamp in ("D65", "FL11", FILE):
            row = table[int(row_of(lamp, [FILE]))]
            np.testing.assert_allclose(row[:-1], scene_matrix(space, "D65+smooth", lamp).T, rtol=1e-6)
            # A lamp's own colour has a luminance of 1.
            assert row[-1].sum() == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("space", list(RGB_SPACES))
def test_a_light_gets_the_temperature_of_its_colour(space):
    lamps = lamps_of_table()
    for lamp in ("2700K", "D5500", "D12000"):
        row = nearest_row(5 * lamp_rgb(space, lamp), space)
        assert lamps[int(row)] == lamps[int(row_of(lamp))]
    for rgb in ((1, 1, 1), (0, 0, 0), (0.1, 1, 0.1), (1, 0, 1)):
        assert nearest_row(rgb, space) == 0
