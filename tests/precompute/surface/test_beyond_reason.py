# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that no instrument writes: unreasonable sizes, no files, tails, bombs. All are refused quickly."""

import os
import struct
import time
import tracemalloc
import zlib

import numpy as np
import pytest
from gwyfile.objects import GwyDataField
from PIL import Image

from precompute.base.failure import GratingError
from precompute.surface.readers.reader_registry import extensions, read_height_map, reader_of
from tests.precompute.surface.scan_files import (
    COLS,
    GREY8,
    PIXEL_M,
    ROWS,
    SIZE_UM,
    TILTED,
    gwy_bytes,
    nid_bytes,
    picture,
    read_picture,
)

SIZES = {"size_um": SIZE_UM, "height_nm": 200.0}
GIB = 1 << 30


def nid_with(**entries):
    """A .nid file with replaced entries in its channels' sections, for example Dim0Range="1e3"."""
    data = nid_bytes(TILTED)
    for key, value in entries.items():
        data = data.replace(f"\n{key}=".encode(), f"\n{key}={value}\r\nX=".encode())
    return data


def gwy_with(heights=TILTED, width_m=COLS * PIXEL_M, height_m=ROWS * PIXEL_M):
    return gwy_bytes({"/0/data": GwyDataField(heights, width_m, height_m, si_unit_xy="m", si_unit_z="m")})


def peak_of(read):
    """What `read` returns or its GratingError, and the peak bytes of Python and NumPy."""
    tracemalloc.start()
    try:
        found = read()
    except GratingError as error:
        found = error
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    return found, peak


@pytest.mark.parametrize("side", ["1", "1e-16", "1e308", "inf", "9" * 400])
def test_pixels_beyond_reason(fails, side):
    """A picometre is a hundredth of an atom; light does not see pixels of a millimetre as one surface."""
    assert "pixel" in fails("wide.nid", nid_with(Dim0Range=side))
    assert "pixel" in fails("high.nid", nid_with(Dim1Range=side))
    assert "pixel" in fails("wide.gwy", gwy_with(width_m=float(side)))
    assert "pixel" in fails("high.gwy", gwy_with(height_m=float(side)))


@pytest.mark.parametrize("side", ["0", "-1e-6", "nan"])
def test_sides_that_are_no_lengths(fails, side):
    assert "pixel" in fails("none.nid", nid_with(Dim0Range=side))
    assert "pixel" in fails("none.gwy", gwy_with(height_m=float(side)))


def test_a_picture_s_pixels_are_judged_as_well(tmp_path):
    path = picture(tmp_path / "grey.png", GREY8)
    with pytest.raises(GratingError, match="a pixel of 0.025 m .*; "):
        read_picture(path, size_um=1e6)


@pytest.mark.parametrize("factor", [1e5, 1e300])
def test_reliefs_over_a_millimetre(fails, factor, recwarn):
    assert "relief" in fails("deep.nid", nid_with(Dim2Range=repr(factor)))
    assert "relief" in fails("deep.gwy", gwy_with(TILTED * factor))
    assert not recwarn.list


def test_a_relief_that_lies_astronomically_high(fails):
    """Heights that far up have no digits left for the relief."""
    assert "above" in fails("far.gwy", gwy_with(np.where(TILTED > 1e-7, 3e6 + 1e-9, 3e6)))


@pytest.mark.parametrize("value", ["inf", "-inf", "nan", "1e309"])
def test_heights_that_are_no_numbers(fails, value, recwarn):
    for key in ("Dim2Range", "Dim2Min"):
        assert "; " in fails("odd.nid", nid_with(**{key: value}))
    heights = TILTED.copy()
    heights[3, 4] = float(value)
    if np.isinf(float(value)):
        assert "infinite" in fails("odd.gwy", gwy_with(heights))
    assert not recwarn.list


@pytest.mark.parametrize("value", [1e-308, 1e308, float("nan"), -1.0, float("inf"), 0.0])
@pytest.mark.parametrize("name", ["size_um", "height_nm"])
def test_sizes_of_a_picture_beyond_reason(tmp_path, name, value):
    path = picture(tmp_path / "grey.png", GREY8)
    with pytest.raises(GratingError, match=f"grey.png: .*--{name.replace('_', '-')}"):
        read_picture(path, **{name: value})


@pytest.mark.parametrize("extension", extensions())
def test_what_is_no_file_is_not_waited_for(tmp_path, extension):
    fifo = tmp_path / f"fifo{extension}"
    os.mkfifo(fifo)
    with pytest.raises(GratingError, match="fifo.*: is not a file; "):
        read_height_map(str(fifo), **SIZES)
    for device in ("/dev/zero", "/dev/null"):
        link = tmp_path / f"{device[5:]}{extension}"
        link.symlink_to(device)
        with pytest.raises(GratingError, match="is not a file; "):
            reader_of(str(link))


def test_a_link_is_followed_unless_it_leads_round_in_a_circle(tmp_path):
    (tmp_path / "true.nid").write_bytes(nid_bytes(TILTED))
    (tmp_path / "link.nid").symlink_to("true.nid")
    assert read_height_map(str(tmp_path / "link.nid")).rows == ROWS
    (tmp_path / "circle.nid").symlink_to("circle.nid")
    with pytest.raises(GratingError, match="cannot be read"):
        read_height_map(str(tmp_path / "circle.nid"))


def test_a_name_that_no_file_can_have():
    with pytest.raises(GratingError, match="cannot be read"):
        read_height_map("a\0b.nid")


@pytest.mark.parametrize("name", ["scan.nid", "scan.gwy", "scan.png", "scan.tif", "scan.bmp"])
def test_a_tail_of_4_gib_is_not_read(tmp_path, name):
    """The sparse file takes no room. Refused or read without its tail, its zeros are not held in memory."""
    path = tmp_path / name
    if name.endswith("nid"):
        path.write_bytes(nid_bytes(TILTED))
    elif name.endswith("gwy"):
        path.write_bytes(gwy_with())
    else:
        picture(path, GREY8)
    os.truncate(path, path.stat().st_size + 4 * GIB)
    found, peak = peak_of(lambda: read_height_map(str(path), **({} if name[5:] in ("nid", "gwy") else SIZES)))
    assert isinstance(found, GratingError) or found.rows == ROWS
    assert peak < 16 << 20


def test_a_header_without_end_is_not_read_to_the_end_of_the_file(tmp_path):
    path = tmp_path / "endless.nid"
    path.write_bytes(nid_bytes(TILTED)[:500])
    os.truncate(path, 4 * GIB)
    found, peak = peak_of(lambda: read_height_map(str(path)))
    assert "no end" in str(found)
    assert peak < 64 << 20


@pytest.mark.parametrize("count", ["1000000000", "9" * 400, "-1", "0", "nan", ""])
def test_channel_counts_are_not_believed(tmp_path, count):
    """The channels that the header names are counted instead."""
    path = tmp_path / "counts.nid"
    data = nid_bytes(TILTED)
    for key in (b"GroupCount", b"Gr0-Count", b"Gr1-Count"):
        data = data.replace(key + b"=", key + b"=" + count.encode() + b"\r\nX=")
    path.write_bytes(data)
    start = time.process_time()
    assert len(read_height_map(str(path)).channels) == 3
    assert time.process_time() - start < 5


@pytest.mark.parametrize("key", ["Points", "Lines", "SaveBits", "Dim0Range", "Dim2Range"])
@pytest.mark.parametrize("value", ["9" * 400, "9" * 5000, "x" * 5000, "-1", "1e9", ""])
def test_a_line_of_error_stays_short(fails, key, value):
    assert len(fails("long.nid", nid_with(**{key: value}))) < 400


def test_ten_thousand_channels_are_not_all_listed(fails):
    channels = tuple((f"Deflection {i} " + "x" * 300, "V", "Scan forward") for i in range(200))
    assert len(fails("many.nid", nid_bytes(TILTED, channels=channels))) < 2000
    fields = {f"/{i}/data": TILTED[:1, :1] for i in range(300)}
    assert len(fails("many.gwy", gwy_bytes(fields))) < 2000


def test_a_channel_s_name_prints(tmp_path):
    path = tmp_path / "bell.gwy"
    path.write_bytes(gwy_bytes({"/0/data/title": "Height\x1b[2J\a", "/0/data": TILTED}))
    assert read_height_map(str(path)).channel.isprintable()


def curve_channels(unit_x, unit_y):
    """A force curve file: every channel has one axis."""
    data = nid_bytes(TILTED, channels=(("Deflection", "N", "Scan forward"), ("Z-Axis", "m", "Scan forward")))
    data = data.replace(b"Dim0Unit=m", f"Dim0Unit={unit_x}".encode())
    return data.replace(b"Dim1Unit=m", f"Dim1Unit={unit_y}".encode()).replace(b"Scan", b"Spec")


@pytest.mark.parametrize("units", [("m", ""), ("s", ""), ("V", "m")])
def test_force_curves_are_told_to_be_no_image(fails, units):
    told = fails("curve.nid", curve_channels(*units))
    assert "no image" in told and "export the topography" in told
    without = curve_channels("m", "").replace(b"Dim1Unit=", b"X=").replace(b"Dim1Range=", b"Y=")
    assert "no image" in fails("bare.nid", without)


def container(*components):
    data = b"".join(components)
    return b"GWYPGwyContainer\0" + struct.pack("<I", len(data)) + data


@pytest.mark.parametrize("depth", [200, 100_000])
def test_containers_that_nest_deep(tmp_path, depth):
    nested = b""
    for _ in range(min(depth, 5000)):
        nested = b"x\0oGwyContainer\0" + struct.pack("<I", len(nested)) + nested
    if depth > 5000:  # by hand: each level holds the next, from the inside out
        head = len(b"x\0oGwyContainer\0") + 4
        nested = b"".join(
            b"x\0oGwyContainer\0" + struct.pack("<I", head * (depth - 1 - level)) for level in range(depth)
        )
    path = tmp_path / "nested.gwy"
    path.write_bytes(container(nested, gwy_with()[len(b"GWYPGwyContainer\0") + 4 :]))
    assert read_height_map(str(path)).rows == ROWS


def test_millions_of_components(fails):
    start = time.process_time()
    assert "components" in fails("many.gwy", container(b"\0b\0" * 3_000_000))
    strings = b"s\0S" + struct.pack("<I", 10**9) + bytes(3_000_000)
    assert "; " in fails("strings.gwy", container(strings))
    assert time.process_time() - start < 5


def png_chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png_of(rows, cols, *chunks, depth=8, colour=0, channels=1):
    """A black PNG with `chunks` before its picture."""
    line = zlib.compressobj(9)
    row = bytes(1 + cols * channels * depth // 8)
    data = b"".join([*(line.compress(row) for _ in range(rows)), line.flush()])
    header = struct.pack(">IIBBBBB", cols, rows, depth, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        [png_chunk(b"IHDR", header), *chunks, png_chunk(b"IDAT", data), png_chunk(b"IEND", b"")]
    )


@pytest.mark.parametrize("kind", ["L", "LA", "RGB", "RGBA", "16", "1", "P"])
def test_a_picture_is_read_with_8_bytes_a_pixel_over_its_heights(tmp_path, kind):
    """A picture bomb: a small file of many pixels. Pillow's own pixels, of at most 4 bytes, are not traced here."""
    side = 2000
    shades = np.arange(side, dtype=np.uint8)[:, None] ^ np.arange(side, dtype=np.uint8)
    image = Image.fromarray(shades) if kind != "16" else Image.fromarray(shades.astype(np.uint16))
    (image if kind in ("L", "16") else image.convert(kind)).save(tmp_path / "large.png")
    found, peak = peak_of(lambda: read_picture(tmp_path / "large.png"))
    assert found.height_m.shape == (side, side)
    assert peak <= (8 + 8 - 4) * side**2 + (8 << 20)


def test_chunks_beside_the_picture_are_not_held(tmp_path, fails):
    """Text and a profile that unpack to 200 MB, and a chunk that is itself huge."""
    bomb = zlib.compress(bytes(200 << 20), 9)
    for kind, head in ((b"zTXt", b"key\0\0"), (b"iCCP", b"name\0\0"), (b"iTXt", b"key\0\1\0\0\0")):
        path = tmp_path / "bomb.png"
        path.write_bytes(png_of(2, 2, png_chunk(kind, head + bomb)))
        found, peak = peak_of(lambda path=path: read_picture(path))
        assert isinstance(found, GratingError) or found.rows == 2
        assert peak < 128 << 20
    vast = tmp_path / "vast.png"
    vast.write_bytes(png_of(2, 2)[:33] + struct.pack(">I", 2**31 - 1) + b"teXt")
    os.truncate(vast, 3 * GIB)
    found, peak = peak_of(lambda: read_picture(vast))
    assert "beside" in str(found)
    assert peak < 16 << 20


def tiff_of(entries, tail=b"", next_directory=0):
    """A little-endian TIFF of one directory of (tag, type, count, value)."""
    directory = struct.pack("<H", len(entries))
    directory += b"".join(struct.pack("<HHII", *entry) for entry in entries)
    return b"II*\0" + struct.pack("<I", 8) + directory + struct.pack("<I", next_directory) + tail


SMALL = [(256, 3, 1, 2), (257, 3, 1, 2), (258, 3, 1, 8), (259, 3, 1, 1), (262, 3, 1, 1), (273, 4, 1, 8), (279, 4, 1, 4)]


def test_a_tiff_of_100_000_pages_is_refused_at_the_second(tmp_path):
    page = 2 + 12 * len(SMALL) + 4
    body = b"".join(
        struct.pack("<H", len(SMALL))
        + b"".join(struct.pack("<HHII", *entry) for entry in SMALL)
        + struct.pack("<I", 8 + page * (number + 1) if number + 1 < 100_000 else 0)
        for number in range(100_000)
    )
    path = tmp_path / "pages.tif"
    path.write_bytes(b"II*\0" + struct.pack("<I", 8) + body)
    start = time.process_time()
    found, peak = peak_of(lambda: read_picture(path))
    assert "several pictures" in str(found)
    assert time.process_time() - start < 5 and peak < 64 << 20


def test_a_tiff_whose_tags_share_one_region(tmp_path):
    """60,000 tags of a megabyte each point to the same megabyte: 60 GB if each is held."""
    entries = SMALL + [(40_000 + k % 20_000, 1, 1 << 20, 8) for k in range(60_000)]
    path = tmp_path / "tags.tif"
    path.write_bytes(tiff_of(entries, bytes(1 << 20)))
    start = time.process_time()
    found, peak = peak_of(lambda: read_picture(path))
    assert "beside" in str(found)
    assert time.process_time() - start < 5 and peak < 64 << 20


def test_a_tag_of_4_gib(tmp_path):
    path = tmp_path / "tag.tif"
    path.write_bytes(tiff_of([*SMALL, (700, 1, 2**32 - 1, 8)]))
    os.truncate(path, 5 * GIB)
    found, peak = peak_of(lambda: read_picture(path))
    assert "beside" in str(found)
    assert peak < 64 << 20


def test_a_bmp_whose_header_is_4_gib(tmp_path):
    path = tmp_path / "header.bmp"
    path.write_bytes(b"BM" + struct.pack("<IHHI", 0, 0, 0, 54) + struct.pack("<I", 2**32 - 1))
    os.truncate(path, 5 * GIB)
    found, peak = peak_of(lambda: read_picture(path))
    assert isinstance(found, GratingError)
    assert peak < 64 << 20
