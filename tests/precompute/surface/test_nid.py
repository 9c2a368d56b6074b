# SPDX-License-Identifier: GPL-3.0-or-later
"""Nanosurf files."""

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.readers.reader_registry import read_height_map
from tests.precompute.surface.scan_files import PIXEL_M, ROWS, TILTED, nid_bytes


@pytest.mark.parametrize("bits", [16, 32])
@pytest.mark.parametrize("signed", [True, False])
def test_nid_values_are_fractions_of_the_declared_range(tmp_path, bits, signed):
    path = tmp_path / "tilted.nid"
    path.write_bytes(nid_bytes(TILTED, bits, signed))
    hm = read_height_map(str(path))
    np.testing.assert_allclose(hm.height_m, TILTED, rtol=0, atol=0.5 * 8e-7 / 2**bits + 1e-21)


def test_nid_pixels_need_not_be_square(tmp_path):
    path = tmp_path / "flat.nid"
    path.write_bytes(nid_bytes(TILTED).replace(b"Dim1Range=", b"Dim1Range=3e-6\r\nX="))
    assert read_height_map(str(path)).pixel_size_m == pytest.approx((3e-6 / ROWS, PIXEL_M), rel=1e-12)


def test_nid_channels_are_listed_and_chosen(tmp_path):
    path = tmp_path / "tilted.nid"
    path.write_bytes(nid_bytes(TILTED))
    listed = ("Amplitude forward", "Z-Axis forward", "Z-Axis backward")
    cases = (None, listed[1], 1), ("z-axis", listed[1], 1), ("Z-Axis backward", listed[2], -1)
    for asked, got, sign in cases:
        hm = read_height_map(str(path), channel=asked)
        assert (hm.channel, hm.channels) == (got, listed)
        np.testing.assert_allclose(hm.height_m, sign * TILTED, rtol=0, atol=8e-7 / 2**32)
    with pytest.raises(GratingError, match="in 'V', not in metres"):
        read_height_map(str(path), channel="Amplitude")
    with pytest.raises(GratingError, match="no channel 'Phase'; name one of: 'Amplitude forward', "):
        read_height_map(str(path), channel="Phase")


def test_nid_without_a_topography_asks_for_a_channel(fails):
    channels = (("Deflection", "m", "Scan forward"), ("Deflection", "m", "Scan backward"))
    assert "--channel: 'Deflection forward'" in fails("deflection.nid", nid_bytes(TILTED, channels=channels))


def test_nid_topography_is_found_behind_other_lengths(shared_data):
    hm = read_height_map(str(shared_data / "formats" / "st_nid-1.nid"))
    assert hm.channel == "Z-Axis forward"
    assert len(hm.channels) == 8
    assert hm.size_m == pytest.approx((20e-6, 20e-6))


def test_nid_that_is_not_whole(fails):
    data = nid_bytes(TILTED)
    assert "truncated" in fails("short.nid", data[:-1])
    assert "truncated" in fails("header.nid", data[:300])
    assert "truncated" in fails("vast.nid", nid_bytes(TILTED, points=10**9, lines=10**9))
    assert "damaged" in fails("none.nid", nid_bytes(TILTED, points=-40))
    assert "damaged" in fails("sections.nid", data.replace(b"[DataSet-1]", b"[DataSet-9]"))
    assert "damaged" in fails("ascii.nid", data.replace(b"SaveMode=Binary", b"SaveMode=ASCII"))
    assert "pixel size" in fails("size.nid", data.replace(b"Dim0Range=", b"Dim0Range=0;"[:-1] + b"\r\nX="))
