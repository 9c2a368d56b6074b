# SPDX-License-Identifier: GPL-3.0-or-later
"""Gwyddion files."""

import struct

import numpy as np
import pytest
from gwyfile.objects import GwyDataField

from precompute.base.failure import GratingError
from precompute.surface.readers.reader_registry import read_height_map
from tests.precompute.surface.scan_files import COLS, ROWS, TILTED, gwy_bytes


def test_gwy_titles_masks_and_channels(tmp_path):
    mask = np.zeros((ROWS, COLS))
    mask[2, 7] = 1
    path = tmp_path / "several.gwy"
    path.write_bytes(
        gwy_bytes(
            {
                "/0/data/title": "Phase",
                "/0/data": -TILTED,
                "/1/data/title": "Height",
                "/1/data": TILTED,
                "/1/mask": mask,
                "/10/data/title": "Height",
                "/10/data": 2 * TILTED,
                "/3/data": 3 * TILTED,
            }
        )
    )
    hm = read_height_map(str(path))
    assert hm.channels == ("Phase", "Height (1)", "channel 3", "Height (10)")
    assert hm.channel == "Height (1)"
    assert np.argwhere(np.isnan(hm.height_m)).tolist() == [[2, 7]]
    np.testing.assert_array_equal(hm.height_m[mask == 0], TILTED[mask == 0])
    np.testing.assert_array_equal(read_height_map(str(path), channel="Height (10)").height_m, 2 * TILTED)


def test_gwy_pixels_need_not_be_square(tmp_path):
    field = GwyDataField(TILTED, 3e-6, 1e-6, si_unit_xy="m", si_unit_z="m")
    (tmp_path / "flat.gwy").write_bytes(gwy_bytes({"/0/data": field}))
    assert read_height_map(str(tmp_path / "flat.gwy")).size_m == pytest.approx((1e-6, 3e-6), rel=1e-15)


def test_gwy_without_metres_is_refused(fails, shared_data):
    volts = GwyDataField(TILTED, 1e-6, 1e-6, si_unit_xy="m", si_unit_z="V")
    told = fails("volts.gwy", gwy_bytes({"/0/data/title": "Height", "/0/data": volts}))
    assert told.startswith("channel 'Height' is in 'V', not in metres; export the height channel, or give it its units")
    assert "no channel holds heights ('A' is in 'V', not in metres, 'B' is in" in fails(
        "two.gwy", gwy_bytes({"/0/data/title": "A", "/0/data": volts, "/1/data/title": "B", "/1/data": volts})
    )
    with pytest.raises(GratingError, match="channel 'Test' has no unit of height; "):
        read_height_map(str(shared_data / "formats" / "gwyfile_test.gwy"))


def test_gwy_that_is_not_whole(fails):
    data = gwy_bytes({"/0/data/title": "Height", "/0/data": TILTED})
    assert "truncated" in fails("short.gwy", data[:-1])
    assert "truncated" in fails("empty.gwy", b"GWYP")
    wide = data.replace(b"xres\0i" + struct.pack("<i", COLS), b"xres\0i" + struct.pack("<i", 10**9))
    assert "damaged" in fails("size.gwy", wide)
    endless = b"x\0s" + b"no end"
    assert "no end" in fails("endless.gwy", b"GWYPGwyContainer\0" + struct.pack("<I", len(endless)) + endless)


def test_the_topography_is_found_behind_its_sensor(tmp_path):
    path = tmp_path / "sensor.gwy"
    titles = {"/0/data/title": "Height Sensor", "/1/data/title": "Height"}
    path.write_bytes(gwy_bytes(titles | {"/0/data": -TILTED, "/1/data": TILTED}))
    assert read_height_map(str(path)).channel == "Height"
