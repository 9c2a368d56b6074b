# SPDX-License-Identifier: GPL-3.0-or-later
"""Details of single microscopes' formats: frames, directions and units."""

import struct

import numpy as np
import pytest
from gwyfile.objects import GwyDataField

from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.base.failure import GratingError
from precompute.surface.quality import describe
from precompute.surface.readers.reader_registry import read_height_map, read_other_way
from tests.hostile import instruments, microscopes
from tests.hostile.instruments import SPAN_M
from tests.precompute.surface.scan_files import COLS, PIXEL_M, ROWS, SIZE_UM, TILTED, gwy_bytes, nid_bytes

HEIGHTS = TILTED - 100e-9


def write(folder, name, data):
    path = folder / name
    path.write_bytes(data)
    return str(path)


def test_nt_mdt_lists_scans_and_curves(tmp_path, fails):
    whole = microscopes.ntmdt(HEIGHTS, PIXEL_M)
    listed = ("Height forward", "FB Out forward", "curves")
    assert read_height_map(write(tmp_path, "scan.mdt", whole)).channels == listed
    with pytest.raises(GratingError, match="'FB Out forward' is in 'deg', not in metres"):
        read_height_map(str(tmp_path / "scan.mdt"), channel="FB")
    with pytest.raises(GratingError, match="'curves' holds curves, not an image"):
        read_height_map(str(tmp_path / "scan.mdt"), channel="curves")
    only_curves = microscopes.ntmdt_file([microscopes.ntmdt_frame(201, bytes(80), bytes(20))])
    assert "holds curves" in fails("curves.mdt", only_curves)
    only_text = microscopes.ntmdt_file([microscopes.ntmdt_frame(3, b"", b"text")])
    assert "no frame holds a scan" in fails("text.mdt", only_text)


def test_nt_mdt_passes_and_directions(tmp_path):
    whole = microscopes.ntmdt_mda(HEIGHTS, PIXEL_M)
    path = write(tmp_path, "mda.mdt", whole)
    assert read_height_map(path).channels == ("Iprobe forward", "Height backward", "Height forward", "Raman")
    np.testing.assert_allclose(read_height_map(path, channel="height b").height_m, -HEIGHTS, rtol=1e-12)
    second = write(tmp_path, "second.mdt", whole.replace(b"1F:Height", b"2F:Height"))
    assert read_height_map(second).channel == "Height forward 2"


def test_nt_mdt_integers_lie_behind_listed_points(tmp_path):
    path = write(tmp_path, "points.mdt", microscopes.ntmdt(HEIGHTS, PIXEL_M, points=3))
    np.testing.assert_allclose(read_height_map(path).height_m, HEIGHTS, rtol=1e-6, atol=SPAN_M / 2**17 * 1.001)


@pytest.mark.parametrize("code, metres", [(-5, 1.0), (-2, 1e-6), (-1, 1e-9), (0, 1e-10)])
def test_nt_mdt_codes_of_lengths(tmp_path, code, metres):
    """The third axis of the first frame, which begins at byte 33 after a header of 22."""
    whole = bytearray(microscopes.ntmdt(HEIGHTS, PIXEL_M))
    struct.pack_into("<2fh", whole, 33 + 22 + 20, 100e-9 / metres, SPAN_M / 2**16 / metres, code)
    height_map = read_height_map(write(tmp_path, "unit.mdt", bytes(whole)))
    np.testing.assert_allclose(height_map.height_m, HEIGHTS, rtol=1e-6, atol=SPAN_M / 2**17 * 1.001)


def test_nt_mdt_frames_that_are_beyond_the_file_or_themselves(fails):
    whole = bytearray(microscopes.ntmdt(HEIGHTS, PIXEL_M))
    struct.pack_into("<I", whole, 33, 2**31)
    assert "frame 1 declares 2147483648 bytes" in fails("long.mdt", bytes(whole))
    whole = bytearray(microscopes.ntmdt(HEIGHTS, PIXEL_M))
    struct.pack_into("<2H", whole, 33 + 22 + 80 + 2, 40, 4000)
    assert "declares 4000 x 40 values" in fails("high.mdt", bytes(whole))


def test_nanonis_directions_are_told_apart(tmp_path):
    """Backward lines begin at their right end; the amplitude is in metres but is read only on request."""
    path = write(tmp_path, "scan.sxm", microscopes.sxm(HEIGHTS, PIXEL_M))
    listed = ("Current forward", "Current backward", "Z forward", "Z backward", "Amplitude forward")
    assert read_height_map(path).channels == listed
    back = read_height_map(path, channel="Z backward")
    np.testing.assert_allclose(back.height_m, -HEIGHTS, rtol=1e-7, atol=100e-9 / 2**24)
    with pytest.raises(GratingError, match="'Current forward' is in 'A', not in metres"):
        read_height_map(path, channel="Current")


@pytest.mark.parametrize("upward", [True, False])
def test_nanonis_of_version_1_tells_rows_before_columns(tmp_path, upward):
    path = write(tmp_path, "old.sxm", microscopes.sxm(HEIGHTS, PIXEL_M, version=1, upward=upward))
    np.testing.assert_allclose(read_height_map(path).height_m, HEIGHTS, rtol=1e-7, atol=100e-9 / 2**24)


def test_a_nanonis_scan_that_was_broken_off(tmp_path, fails):
    """The scan runs upward, so the top lines are missing; a scan without any line is refused."""
    begun = HEIGHTS.copy()
    begun[:10] = np.nan
    height_map = read_height_map(write(tmp_path, "begun.sxm", microscopes.sxm(begun, PIXEL_M)))
    np.testing.assert_array_equal(np.isnan(height_map.height_m), np.isnan(begun))
    nothing = microscopes.sxm(np.full_like(HEIGHTS, np.nan), PIXEL_M)
    assert "every height is missing" in fails("nothing.sxm", nothing)


def test_a_nanonis_map_out_of_a_grid_holds_one_direction(tmp_path):
    """Such a file still declares "both", and has no time."""
    whole = microscopes.sxm(HEIGHTS, PIXEL_M)
    start, size = whole.index(b"\x1a\x04") + 2, 4 * HEIGHTS.size
    header = whole[:start].replace(b"       470.3", b"N/A")
    data = whole[start : start + size] + whole[start + 2 * size : start + 3 * size] + whole[start + 4 * size :]
    height_map = read_height_map(write(tmp_path, "cut.sxm", header + data))
    assert height_map.channels == ("Current forward", "Z forward", "Amplitude forward")
    np.testing.assert_allclose(height_map.height_m, HEIGHTS, rtol=1e-7, atol=100e-9 / 2**24)


@pytest.mark.parametrize(
    "old, new, told",
    [
        (b"FLOAT            MSBFIRST", b"DOUBLE           MSBFIRST", "values stored as DOUBLE MSBFIRST"),
        (b"\tUnit\tDirection", b"\tDirection\tUnit", "channels listed by"),
        (b":SCANIT_END:\n\n\n\x1a\x04", b":SCANIT_END:\n\n\n\x1a\x05", "the header has no end"),
        (b":SCAN_RANGE:", b":SCAN_ANGLE:", "'SCAN_RANGE' is missing"),
    ],
)
def test_nanonis_headers_that_are_not_understood(fails, old, new, told):
    whole = microscopes.sxm(HEIGHTS, PIXEL_M)
    assert old in whole
    assert told in fails("odd.sxm", whole.replace(old, new, 1))


@pytest.mark.parametrize("version", [0, 1, 2])
def test_frames_of_a_high_speed_movie(tmp_path, version):
    path = write(tmp_path, "movie.asd", microscopes.asd(HEIGHTS, PIXEL_M, version=version))
    assert read_height_map(path).channels == ("Topography 1", "Phase 1", "Topography 2", "Phase 2")
    second = read_height_map(path, channel="topography 2")
    np.testing.assert_allclose(second.height_m, HEIGHTS / 2, atol=SPAN_M / 2**16 * 1.001)
    with pytest.raises(GratingError, match="'Phase 1' is in 'deg', not in metres"):
        read_height_map(path, channel="Phase")


def test_a_converter_whose_sign_is_not_known_is_told(fails):
    """Code 3 is 0 V to 9.99 V."""
    line = fails("unipolar.asd", microscopes.asd(HEIGHTS, PIXEL_M, range_code=3))
    assert "'Topography 1' is in 'levels of a unipolar converter', not in metres" in line


def test_high_speed_movies_that_promise_more_than_they_hold(fails):
    whole = bytearray(microscopes.asd(HEIGHTS, PIXEL_M))
    struct.pack_into("<i", whole, 36, 3)
    assert "values declared, and" in fails("frames.asd", bytes(whole))
    struct.pack_into("<i", whole, 36, 2**30)
    assert "frames of 2 channels" in fails("movie.asd", bytes(whole))


def test_swapped_axes_of_park_are_turned_as_gwyddion_turns_them(tmp_path):
    """By 90 degrees counterclockwise, with the sides."""
    whole = bytearray(instruments.park(HEIGHTS, PIXEL_M))
    header = whole.index("Z Height".encode("utf-16-le")) - 4
    struct.pack_into("<I", whole, header + 136, 1)
    struct.pack_into("<d", whole, header + 148, 2 * HEIGHTS.shape[0] * PIXEL_M * 1e6)
    height_map = read_height_map(write(tmp_path, "swapped.tiff", bytes(whole)))
    np.testing.assert_allclose(height_map.height_m, np.rot90(HEIGHTS), atol=1e-13)
    assert height_map.pixel_size_m == pytest.approx((PIXEL_M, 2 * PIXEL_M))


def test_sides_and_heights_in_other_units_than_metres(tmp_path):
    """Gwyddion and Nanosurf write metres; other programs that write their formats need not."""
    field = GwyDataField(HEIGHTS * 1e9, COLS * PIXEL_M * 1e6, ROWS * PIXEL_M * 1e6, si_unit_xy="um", si_unit_z="nm")
    nid = nid_bytes(HEIGHTS)
    for key, size, unit in ((b"Dim0Range", COLS * PIXEL_M, b"Dim0Unit"), (b"Dim1Range", ROWS * PIXEL_M, b"Dim1Unit")):
        nid = nid.replace(b"%s=%r" % (key, size), b"%s=%r" % (key, size * 1e6)).replace(unit + b"=m", unit + b"=um")
    for name, data in (("um.gwy", gwy_bytes({"/0/data": field})), ("um.nid", nid)):
        height_map = read_height_map(write(tmp_path, name, data))
        np.testing.assert_allclose(height_map.height_m, HEIGHTS, atol=1e-15)
        assert height_map.pixel_size_m == pytest.approx((PIXEL_M, PIXEL_M))


def test_a_width_replaces_the_file_s_own_with_a_warning(tmp_path, fails):
    """The pixels keep their aspect ratio, also in the scan of the other direction. The file's heights stay."""
    whole = instruments.gsf(HEIGHTS, PIXEL_M, across=2.0)
    path = write(tmp_path, "wide.gsf", whole)
    height_map = read_height_map(path, 9.99999)
    assert height_map.size_m == pytest.approx((9.99999e-6 / COLS * ROWS / 2, 9.99999e-6))
    told = "the width is 10 um as given, instead of the 2000 nm in the file"
    assert ("size", "usable", told) in [(f.topic, f.light, f.sentence) for f in describe(height_map).quality.findings]
    facts = bake_to_folder([height_map], BakeRequest(), tmp_path / "out")
    assert facts["levelling"][0] == f"warning: {told}"
    assert "a Gwyddion Simple Field file does not need it; leave out --height-nm" in fails("a.gsf", whole, height_nm=1)

    whole = instruments.agilent(HEIGHTS, PIXEL_M)
    own = read_height_map(write(tmp_path, "own.mi", whole))
    for key in (b"xLength", b"yLength"):
        at = whole.index(key)
        whole = whole[:at] + whole[whole.index(b"\n", at) + 1 :]
    assert (
        fails("bare.mi", whole)
        == "the file has no usable pixel size; give --size-um, the width of the scan in micrometres"
    )
    given = read_height_map(str(tmp_path / "bare.mi"), SIZE_UM)
    assert given.size_m == pytest.approx(own.size_m)
    assert read_other_way(given).size_m == given.size_m
    assert "size" not in [finding.topic for finding in describe(given).quality.findings]
