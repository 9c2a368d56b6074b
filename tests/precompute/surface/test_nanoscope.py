# SPDX-License-Identifier: GPL-3.0-or-later
"""NanoScope headers of other versions, made from real files without changing their heights. Gwyddion 2.62 (`gwyddion
--convert-to-gwy`) reads the same heights in each file made here, to 5e-16 of them."""

import json
from pathlib import Path

import numpy as np
import pytest

from laboratory.benchmarks.hostile import instruments
from precompute.base.failure import GratingError
from precompute.surface.readers.reader_registry import read_height_map
from tests.precompute.surface.scan_files import PIXEL_M, TILTED

TABLE = json.loads((Path(__file__).parent / "oracle.json").read_text())
# Keys that version 5 spells in another case than versions 7 to 9.
KEYS = (b"Scan Size", b"Line Direction", b"Aspect Ratio", b"Start context")
PHASE = b"V [Sens. Phase] (0.005493164 \xba/LSB) 359.9945 \xba"
LOGARITHM = b"V [Sens. FVLogModulusSens] (0.0004 log(Arb)/LSB) 32.00000 log(Arb)"


def with_header(data, change):
    """The file with another header and its channels at the same place."""
    start = 40960
    header = change(data[:start].rstrip(b"\0"))
    return header.ljust(start, b"\0") + data[start:]


def in_other_case(header):
    for key in KEYS:
        header = header.replace(b"\\" + key + b":", b"\\" + key.capitalize() + b":")
    return header


@pytest.mark.parametrize("name", ["st_di-1.di", "st_di-3.di"])
@pytest.mark.parametrize(
    "change",
    [in_other_case, lambda header: in_other_case(header).replace(PHASE, LOGARITHM)],
    ids=["version 5", "a phase in log(Arb)"],
)
def test_headers_of_version_5_change_no_height(shared_data, tmp_path, name, change):
    whole = (shared_data / "formats" / name).read_bytes()
    made = with_header(whole, change)
    assert len(made) == len(whole) and made != whole
    (tmp_path / "made.spm").write_bytes(made)
    expected, found = TABLE[name], read_height_map(str(tmp_path / "made.spm"))
    height = found.height_m
    assert list(height.shape) == expected["shape"]
    assert found.size_m == pytest.approx(expected["size_m"], rel=1e-7)
    # Both compute in double precision, with factors in another order.
    tolerance = 1e-13 * np.abs(height).max()
    figures = (height.min(), height.max(), height.std(), *(height[row, col] for row in (0, -1) for col in (0, -1)))
    wanted = [expected[key] for key in ("lowest", "highest", "rms")] + expected["corners"]
    np.testing.assert_allclose(figures, wanted, rtol=0, atol=tolerance)
    assert found.channels == read_height_map(str(shared_data / "formats" / name)).channels


def test_a_channel_in_an_unknown_unit_is_left_out_alone(tmp_path):
    path = tmp_path / "log.spm"
    path.write_bytes(instruments.nanoscope_5(TILTED, PIXEL_M))
    assert read_height_map(str(path)).channels == ("ZSensor trace", "Height retrace", "Phase trace")
    with pytest.raises(GratingError, match=r"'Phase trace' is in 'log\(Arb\)', not in metres; .*'Height retrace'$"):
        read_height_map(str(path), channel="phase")


def test_a_channel_without_a_scale_is_left_out_alone(tmp_path):
    whole = instruments.nanoscope(TILTED, PIXEL_M).replace(b"(0.005 \xba/LSB) 360 \xba", b"(none)".ljust(22))
    (tmp_path / "odd.spm").write_bytes(whole)
    assert read_height_map(str(tmp_path / "odd.spm")).channel == "ZSensor trace"
    with pytest.raises(GratingError, match="'Phase trace' is in 'an unknown unit'"):
        read_height_map(str(tmp_path / "odd.spm"), channel="phase")


def test_the_scan_list_gives_the_size_where_no_image_does(tmp_path):
    """Width before height: 24 rows of 40 columns are 1 um wide."""
    whole = instruments.nanoscope(TILTED, PIXEL_M)
    line = b"\\Scan Size: 1.0 0.6 ~m\r\n"
    assert whole.count(line) == 3
    moved = whole.replace(line, b"").replace(b"\\*Ciao scan list\r\n", b"\\*Ciao scan list\r\n" + line)
    (tmp_path / "moved.spm").write_bytes(moved[:500] + moved[500:].replace(b"end\r\n\0", b"end\r\n" + bytes(49), 1))
    assert read_height_map(str(tmp_path / "moved.spm")).size_m == pytest.approx((0.6e-6, 1e-6))
