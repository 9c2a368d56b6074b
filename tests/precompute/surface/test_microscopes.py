# SPDX-License-Identifier: GPL-3.0-or-later
"""What is particular to the formats of single microscopes: their frames, directions and units."""

import struct

import numpy as np
import pytest

from benchmarks.hostile import microscopes
from benchmarks.hostile.instruments import SPAN_M
from precompute.base.failure import GratingError
from precompute.surface.readers.registry import read_height_map
from tests.precompute.surface.scan_files import PIXEL_M, TILTED

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
    with pytest.raises(GratingError, match="'curves' holds curves and no image"):
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
