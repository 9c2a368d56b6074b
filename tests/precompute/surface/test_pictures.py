# SPDX-License-Identifier: GPL-3.0-or-later
"""Grey PNG, TIFF and BMP pictures."""

import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from benchmarks.hostile import instruments
from precompute.base.failure import GratingError
from tests.precompute.surface.scan_files import GREY8, GREY16, TILTED, picture, read_picture


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "LA", "P"])
def test_grey_in_another_guise_is_the_same_grey(tmp_path, mode):
    Image.fromarray(GREY8).convert(mode).save(tmp_path / "grey.png")
    np.testing.assert_allclose(read_picture(tmp_path / "grey.png").height_m, GREY8 / 255 * 200e-9, rtol=1e-14)


def test_palette_of_greys_is_looked_up(tmp_path):
    indexed = Image.fromarray(255 - GREY8, "L").convert("P")
    indexed.putpalette(np.repeat(np.arange(255, -1, -1), 3).tolist())
    indexed.save(tmp_path / "grey.bmp")
    np.testing.assert_allclose(read_picture(tmp_path / "grey.bmp").height_m, GREY8 / 255 * 200e-9, rtol=1e-14)


def test_transparent_pixels_are_missing(tmp_path):
    rgba = np.repeat(GREY8[..., None], 4, axis=2)
    rgba[..., 3] = 255
    rgba[3, 5] = (255, 0, 0, 0)
    height = read_picture(picture(tmp_path / "hole.png", rgba)).height_m
    assert np.argwhere(np.isnan(height)).tolist() == [[3, 5]]


def test_black_and_white_span_the_whole_height_at_any_depth(tmp_path):
    for black, white, kind in ((0, 255, np.uint8), (0, 65535, np.uint16), (False, True, bool)):
        ends = np.array([[black, white]], kind)
        height = read_picture(picture(tmp_path / "ends.png", ends)).height_m
        np.testing.assert_allclose(height, [[0, 200e-9]], rtol=1e-15)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"size_um": None}, "--size-um W"),
        ({"height_nm": None}, "--height-nm H"),
        ({"size_um": 0}, "size of 0 "),
        ({"size_um": 1e9}, "size of 1e\\+09 "),
        ({"size_um": float("nan")}, "size of nan"),
        ({"size_um": -65}, "size of -65"),
        ({"height_nm": 0}, "height range of 0 "),
        ({"height_nm": 1e9}, "height range of 1e\\+09 "),
        ({"channel": "Z-Axis"}, "leave out --channel"),
    ],
)
def test_a_picture_needs_sensible_sizes(tmp_path, options, told):
    path = picture(tmp_path / "grey.png", GREY8)
    with pytest.raises(GratingError, match=told):
        read_picture(path, **options)


def png_bytes(width, height, depth, colour, rows):
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)),
        (b"IDAT", zlib.compress(rows)),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )


def test_sixteen_bit_colour_is_refused_for_pillow_would_halve_it(fails):
    data = png_bytes(1, 1, 16, 2, b"\0" + b"\x12\x34" * 3)
    assert "16-bit grey" in fails("deep.png", data, size_um=1, height_nm=1)


def test_headers_that_lie_are_found_before_anything_is_allocated(fails):
    sizes = {"size_um": 1, "height_nm": 1}
    assert "more than 89478485 pixels" in fails("bomb.png", png_bytes(50_000, 50_000, 8, 0, b"\0"), **sizes)
    assert "more than the file can hold" in fails("big.png", png_bytes(8192, 8192, 8, 0, b"\0"), **sizes)


def test_a_coloured_picture_is_refused(tmp_path):
    rgb = np.repeat(GREY8[..., None], 3, axis=2)
    rgb[0, 0] = (1, 2, 3)
    with pytest.raises(GratingError, match="coloured"):
        read_picture(picture(tmp_path / "colour.png", rgb))


def test_tiffs_whose_numbers_have_no_white_are_refused(tmp_path):
    for array in (TILTED.astype(np.float32), GREY16.astype(np.int32)):
        with pytest.raises(GratingError, match="16-bit grey"):
            read_picture(picture(tmp_path / "odd.tif", array))
    Image.fromarray(GREY16).save(tmp_path / "white.tif", tiffinfo={262: 0})
    with pytest.raises(GratingError, match="counted from white"):
        read_picture(tmp_path / "white.tif")


def test_a_tiff_of_several_pages_is_refused(tmp_path):
    pages = [Image.fromarray(GREY8)] * 2
    pages[0].save(tmp_path / "pages.tif", save_all=True, append_images=pages[1:])
    with pytest.raises(GratingError, match="several pictures"):
        read_picture(tmp_path / "pages.tif")


@pytest.mark.parametrize("name", ["st_example_ps.tiff", "afmreader_sample_0.jpk"])
def test_instrument_files_in_a_tiff_are_not_taken_for_pictures(shared_data, name):
    with pytest.raises(GratingError, match="a (Park|JPK) file tells this by itself"):
        read_picture(shared_data / "formats" / name)


def test_a_park_file_whose_tags_are_at_its_end_is_not_taken_for_a_picture(fails):
    data = instruments.park(TILTED, 25e-9, first=1 << 16)
    told = fails("late.tiff", data, size_um=1, height_nm=1)
    assert "not in the visible picture" in told
