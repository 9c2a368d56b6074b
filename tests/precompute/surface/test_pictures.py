# SPDX-License-Identifier: GPL-3.0-or-later
"""Grey PNG, TIFF and BMP pictures."""

import struct
import zlib
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from precompute.base.failure import GratingError
from tests.hostile import instruments
from tests.precompute.surface.scan_files import GREY8, GREY16, PIXEL_M, TILTED, picture, read_picture


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
        ends = np.tile(np.array([[black, white]], kind), (8, 4))
        height = read_picture(picture(tmp_path / "ends.png", ends)).height_m
        np.testing.assert_allclose(height, np.tile([[0, 200e-9]], (8, 4)), rtol=1e-15)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"size_um": None}, "give --size-um, the width"),
        ({"height_nm": None}, "give --height-nm, the height"),
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
    with pytest.raises(GratingError, match="16-bit grey"):
        read_picture(picture(tmp_path / "odd.tif", GREY16.astype(np.int32)))
    Image.fromarray(GREY16).save(tmp_path / "white.tif", tiffinfo={262: 0})
    with pytest.raises(GratingError, match="counted from white"):
        read_picture(tmp_path / "white.tif")


def test_floats_of_a_tiff_are_parts_of_white_and_nan_is_missing(tmp_path):
    holed = TILTED.astype(np.float32)
    holed[3, 5] = np.nan
    height_map = read_picture(picture(tmp_path / "metres.tif", holed), height_nm=1e9)
    np.testing.assert_allclose(height_map.height_m, np.where(np.isnan(holed), np.nan, TILTED), rtol=2.0**-24)


def exr(path, channels, compression=OpenEXR.ZIP_COMPRESSION):
    """Write channels {name: array} as an OpenEXR file; return the path as a string."""
    OpenEXR.File({"compression": compression, "type": OpenEXR.scanlineimage}, channels).write(str(path))
    return str(path)


@pytest.mark.parametrize("packing", ["NO_COMPRESSION", "ZIPS_COMPRESSION", "ZIP_COMPRESSION"])
@pytest.mark.parametrize("kind", [np.float32, np.float16])
def test_an_exr_is_read_from_the_top(tmp_path, packing, kind):
    values = (TILTED * 1e7).astype(kind)
    one, three = ({"Y": values}, dict.fromkeys("RGB", values) | {"A": np.ones_like(values)})
    for name, channels in (("one", one), ("three", three)):
        path = exr(tmp_path / f"{name}.exr", channels, getattr(OpenEXR, packing))
        height = read_picture(path, height_nm=100.0).height_m
        np.testing.assert_allclose(height, values.astype(float) * 100e-9, rtol=1e-15)


def test_exrs_that_are_no_heights(tmp_path):
    values = TILTED.astype(np.float32)
    cases = (
        (exr(tmp_path / "colour.exr", {"R": values, "G": values, "B": 2 * values}), "coloured"),
        (exr(tmp_path / "names.exr", {"U": values, "W": values}), "save the heights as the channel Y"),
        (exr(tmp_path / "pxr.exr", {"Y": values}, OpenEXR.PXR24_COMPRESSION), "save it with ZIP or none"),
    )
    for path, told in cases:
        with pytest.raises(GratingError, match=told):
            read_picture(path)


def test_an_exr_that_is_not_whole(fails, tmp_path):
    data = Path(exr(tmp_path / "whole.exr", {"Y": TILTED.astype(np.float32)})).read_bytes()
    sizes = {"size_um": 1, "height_nm": 1}
    assert "missing" in fails("cut.exr", data[:-10], **sizes)
    window = data.index(b"dataWindow\0box2i\0") + 21
    wide = data[:window] + struct.pack("<4i", 0, 0, 10**9, 10**9) + data[window + 16 :]
    assert "pixels declared" in fails("wide.exr", wide, **sizes)


def test_pixels_that_are_not_square(tmp_path):
    """An EXR's are read as declared. The resolutions of other pictures are seldom meant, so they give an error."""
    whole = instruments.exr(TILTED, PIXEL_M)
    mark = b"pixelAspectRatio\0float\0" + struct.pack("<if", 4, 1)
    assert mark in whole
    (tmp_path / "wide.exr").write_bytes(whole.replace(mark, mark[:-4] + struct.pack("<f", 2)))
    height_map = read_picture(tmp_path / "wide.exr")
    assert height_map.pixel_size_m == pytest.approx((PIXEL_M / 2, PIXEL_M))
    for name in ("dpi.png", "dpi.tif", "dpi.bmp"):
        assert read_picture(picture(tmp_path / name, GREY8, dpi=(300, 299))).cols == GREY8.shape[1]
        with pytest.raises(GratingError, match="not square, 300 to 150 per length; resample"):
            read_picture(picture(tmp_path / name, GREY8, dpi=(300, 150)))


def test_pictures_that_are_stored_turned(tmp_path):
    """A flipped TIFF is put upright; a turned one, and any such PNG, gives an error."""
    for name, orientation in (("flipped.tif", 4), ("turned.tif", 6), ("flipped.png", 4)):
        exif = Image.Exif()
        exif[274] = orientation
        path = picture(tmp_path / name, GREY8, exif=exif)
        if name == "flipped.tif":
            np.testing.assert_allclose(read_picture(path).height_m, GREY8[::-1] / 255 * 200e-9, atol=1e-20)
            continue
        with pytest.raises(GratingError, match=f"stored rotated .orientation {orientation}.; rotate it and save"):
            read_picture(path)


def test_a_tiff_of_several_pages_is_refused(tmp_path):
    pages = [Image.fromarray(GREY8)] * 2
    pages[0].save(tmp_path / "pages.tif", save_all=True, append_images=pages[1:])
    with pytest.raises(GratingError, match="several pictures"):
        read_picture(tmp_path / "pages.tif")


@pytest.mark.parametrize("name", ["st_example_ps.tiff", "afmreader_sample_0.jpk"])
def test_instrument_files_in_a_tiff_are_not_taken_for_pictures(shared_data, name):
    with pytest.raises(GratingError, match="a (Park|JPK) file does not need it"):
        read_picture(shared_data / "formats" / name)


def test_a_park_file_whose_tags_are_at_its_end_is_not_taken_for_a_picture(fails):
    data = instruments.park(TILTED, 25e-9, first=1 << 16)
    told = fails("late.tiff", data, size_um=1, height_nm=1)
    assert "not in the visible picture" in told
