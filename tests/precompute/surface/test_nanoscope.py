# SPDX-License-Identifier: GPL-3.0-or-later
"""NanoScope headers of other versions, made from real files without changing their heights. Gwyddion 2.62 (`gwyddion
--convert-to-gwy`) reads the same heights in each file made here, to 5e-16 of them."""

import json
from pathlib import Path

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.readers.reader_registry import read_height_map
from tests.hostile import instruments
from tests.precompute.surface.scan_files import PIXEL_M, TILTED

TABLE = json.loads((Path(__file__).parent / "oracle.json").read_text())
# Keys that version 5 spells in another case than versions 7 to 9.
KEYS = (b"Scan Size", b"Line Direction", b"Aspect Ratio", b"Start context")
PHASE = b"V [Sens. Phase] (0.005493164 \xba/LSB) 359.9945 \xba"
LOGARITHM = b"V [Sens. FVLogModulusSens] (0.0004 log(Arb)/LSB) 32.00000 log(Arb)"


def with_header(data, change, start=40960):
    """The file with another header and its channels at the same place, from byte `start` on."""
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


@pytest.mark.parametrize(
    "before, after", [(b"\\*File list\r", b"\\*Force file list\r"), (b"OL2BIG", b"FOL2BG"), (b"OL2BIG", b"OL2VAR")]
)
def test_curves_are_told_to_be_no_image(fails, before, after):
    """Force curves, and the profiles of unequal lengths of Deep Trench."""
    whole = instruments.nanoscope(TILTED, PIXEL_M)
    assert "holds curves" in fails("curves.spm", whole.replace(before, after, 1))


def test_lengths_need_no_sensitivity(tmp_path):
    whole = instruments.nanoscope(TILTED, PIXEL_M)
    bare = whole.replace(b"V [Sens. ZsensSens] (0.0001 V/LSB) 2 V", b"V (0.0001 nm/LSB) 800 nm              ")
    (tmp_path / "bare.spm").write_bytes(bare)
    found = read_height_map(str(tmp_path / "bare.spm"))
    np.testing.assert_allclose(found.height_m, TILTED, rtol=1e-12, atol=instruments.SPAN_M / 2**17 * 1.001)


@pytest.mark.parametrize(
    "scan_size, sides_um",
    [("\\Scan Size: 2 1 ~m", (1.0, 2.0)), ("\\Scan Size: 500 nm", (0.5, 0.5)), ("\\Scan Size: 5000 \xc5", (0.5, 0.5))],
)
def test_scan_sizes(tmp_path, scan_size, sides_um):
    """Width before height; one number is both."""
    whole = instruments.nanoscope(TILTED, PIXEL_M)
    start = whole.index(b"\\Scan Size")
    length = whole.index(b"\r", start) - start
    for_all = whole.replace(whole[start : start + length], scan_size.encode("latin-1").ljust(length))
    (tmp_path / "sized.spm").write_bytes(for_all)
    assert read_height_map(str(tmp_path / "sized.spm")).size_m == pytest.approx(np.multiply(sides_um, 1e-6), rel=1e-12)


# The sides (Ly, Lx) in um that Gwyddion gives the first channel of st_di-3.di, 256 x 256 points of 10 x 10 um, with
# other headers (its module nanoscope, 2022). If the image's aspect ratio is not 1:1, the height is multiplied by the
# image's rows, and divided by its columns if the scan's ratio is not 1:1 either, else by the scan's rows. "1:2" counts
# as 1. If only the scan's counts fit the length of the data, both sides are scaled by the scan's counts over the
# image's.
ASPECTS = [
    ({"rows": 128, "aspect": "2:1", "scan aspect": "2:1"}, (128, 256), (5.0, 10.0)),
    ({"rows": 128, "aspect": "2:1", "scan aspect": "2:1", "size": "10 5"}, (128, 256), (2.5, 10.0)),
    ({"rows": 128, "aspect": "2:1", "lines": 128}, (128, 256), (10.0, 10.0)),
    ({"rows": 128, "aspect": "1:1", "scan aspect": "2:1"}, (128, 256), (10.0, 10.0)),
    ({"rows": 128}, (128, 256), (10.0, 10.0)),
    ({"cols": 128, "aspect": "1:2", "scan aspect": "1:2"}, (256, 128), (10.0, 10.0)),
    ({"cols": 128, "aspect": "1:2", "scan aspect": "1:2", "size": "5 10"}, (256, 128), (10.0, 5.0)),
    ({"rows": 132, "aspect": "0.516"}, (132, 256), (10.0 * 132 / 256, 10.0)),
    ({"rows": 132, "aspect": "0.516", "scan aspect": "0.7"}, (132, 256), (10.0 * 132 / 256, 10.0)),
    # Later headers: the height of the whole scan, of which an image may have fewer lines.
    ({"rows": 128, "aspect": "2:1", "scan aspect": "2:1", "lines": 128, "slow": 5000}, (128, 256), (5.0, 10.0)),
    ({"rows": 32, "aspect": "8:1", "scan aspect": "2:1", "lines": 128, "slow": 5000}, (32, 256), (1.25, 10.0)),
    # Counts that do not fit the data.
    ({"rows": 512, "held": 32, "lines": 32}, (32, 256), (10.0 * 32 / 512, 10.0)),
    ({"rows": 32, "held": 256}, (256, 256), (10.0 * 256 / 32, 10.0)),
    ({"rows": 32, "held": 48, "lines": 32}, (32, 256), (10.0, 10.0)),
]


def with_counts(header, new):
    """The header with other counts, sizes and aspect ratios in the scan list and in the first image list."""
    scan, mark, images = header.partition(b"\\*Ciao image list")
    first, mark_2, others = images.partition(b"\\*Ciao image list")
    rows, cols = new.get("rows", 256), new.get("cols", 256)
    length = 2 * new.get("held", rows) * cols
    slow = f"\r\n\\Slow Axis Size: {new['slow']} nm" if "slow" in new else ""
    for part, old, value in (
        ("scan", "Lines: 256", f"Lines: {new.get('lines', 256)}"),
        ("scan", "Aspect Ratio: 1:1", f"Aspect Ratio: {new.get('scan aspect', '1:1')}{slow}"),
        ("first", "Number of lines: 256", f"Number of lines: {rows}"),
        ("first", "Samps/line: 256", f"Samps/line: {cols}"),
        ("first", "Aspect Ratio: 1:1", f"Aspect Ratio: {new.get('aspect', '1:1')}"),
        ("first", "Scan Size: 10 10 ~m", f"Scan Size: {new.get('size', '10 10')} ~m"),
        ("first", "Data length: 131072", f"Data length: {length}"),
    ):
        before, after = f"\\{old}\r\n".encode(), f"\\{value}\r\n".encode()
        assert before in (scan if part == "scan" else first)
        scan = scan.replace(before, after) if part == "scan" else scan
        first = first.replace(before, after) if part == "first" else first
    return scan + mark + first + mark_2 + others


def test_counts_and_aspect_ratios_are_read_as_gwyddion_reads_them(shared_data, tmp_path):
    whole = (shared_data / "formats/st_di-3.di").read_bytes()
    heights = read_height_map(str(shared_data / "formats/st_di-3.di")).height_m[::-1].ravel()
    for number, (new, shape, sides_um) in enumerate(ASPECTS):
        path = tmp_path / f"{number}.spm"
        path.write_bytes(with_header(whole, lambda header, new=new: with_counts(header, new)))
        found = read_height_map(str(path), channel="ZSensor trace")
        assert found.height_m.shape == shape, new
        assert found.size_m == pytest.approx(np.multiply(sides_um, 1e-6)), new
        np.testing.assert_array_equal(found.height_m[::-1].ravel(), heights[: shape[0] * shape[1]])


def test_an_electrochemical_file_is_read(tmp_path):
    whole = instruments.nanoscope(TILTED, PIXEL_M)
    made = with_header(whole, lambda header: header.replace(b"\\*File list\r", b"\\*EC File list\r"), start=4096)
    (tmp_path / "ec.spm").write_bytes(made)
    np.testing.assert_allclose(read_height_map(str(tmp_path / "ec.spm")).height_m, TILTED, atol=1e-11)
