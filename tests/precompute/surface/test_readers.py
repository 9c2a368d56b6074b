# SPDX-License-Identifier: GPL-3.0-or-later
import struct
import zlib

import numpy as np
import pytest
from gwyfile.objects import GwyContainer, GwyDataField
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from precompute.base.failure import GratingError
from precompute.surface.readers.registry import FORMATS, read_height_map

# One asymmetric surface for all: a blazed grating whose grating vector is turned 20 degrees from T towards B,
# so that no flip, turn or transpose of it looks the same. Rows run along -B.
ROWS, COLS = 24, 40
PIXEL_M = 25e-9
SIZE_UM = COLS * PIXEL_M * 1e6
HEIGHT_NM = 200.0
Y, X = -np.arange(ROWS)[:, None] * PIXEL_M, np.arange(COLS) * PIXEL_M
TILTED = 200e-9 * (((X * np.cos(np.radians(20)) + Y * np.sin(np.radians(20))) / 310e-9) % 1)
GREY16 = np.round(TILTED / 200e-9 * 65535).astype(np.uint16)
GREY8 = np.round(TILTED / 200e-9 * 255).astype(np.uint8)
HALF_STEP_16, HALF_STEP_8 = 100e-9 / 65535, 100e-9 / 255

NID_CHANNELS = (
    ("Amplitude", "V", "Scan forward"),
    ("Z-Axis", "m", "Scan forward"),
    ("Z-Axis", "m", "Scan backward"),
)


def nid_bytes(height_m, bits=32, signed=True, points=None, lines=None, channels=NID_CHANNELS):
    """A .nid file: heights in the forward Z-Axis, their negative in the backward one, zeros elsewhere."""
    rows, cols = height_m.shape
    header = ["[DataSet]", "Version=2", "GroupCount=2", "Gr0-Count=8", "Gr1-Count=8"]
    header += [f"Gr{int('back' in frame)}-Ch{i}=DataSet-{i}" for i, (_, _, frame) in enumerate(channels)]
    blocks = []
    for i, (name, unit, frame) in enumerate(channels):
        header += [
            "",
            f"[DataSet-{i}]",
            f"Points={points or cols} ",
            f"Lines={lines or rows}",
            f"Frame={frame}",
            "Dim0Unit=m",
            f"Dim0Range={cols * PIXEL_M!r}",
            "Dim1Unit=m",
            f"Dim1Range={rows * PIXEL_M!r}",
            f"Dim2Name={name}",
            f"Dim2Unit={unit}",
            "Dim2Range=8e-07",
            "Dim2Min=-4e-07",
            "SaveMode=Binary",
            f"SaveBits={bits}",
            f"SaveSign={'Signed' if signed else 'Unsigned'}",
            "SaveOrder=Intel",
        ]
        value = {"Scan forward": 1, "Scan backward": -1}[frame] * height_m if unit == "m" else 0 * height_m
        fraction = value / 8e-7 if signed else value / 8e-7 + 0.5
        kind = f"<{'i' if signed else 'u'}{bits // 8}"
        blocks.append(np.round(fraction[::-1] * 2**bits).astype(kind).tobytes())
    return "\r\n".join([*header, "", "#!"]).encode() + b"".join(blocks)


def gwy_bytes(fields):
    """A .gwy file of {key: array or value}; arrays become fields of pixels of PIXEL_M in metres."""
    container = GwyContainer()
    for key, value in fields.items():
        if isinstance(value, np.ndarray):
            rows, cols = value.shape
            value = GwyDataField(value, cols * PIXEL_M, rows * PIXEL_M, si_unit_xy="m", si_unit_z="m")
        container[key] = value
    return b"GWYP" + container.serialize()


def picture(path, array, **options):
    Image.fromarray(array).save(path, **options)
    return str(path)


def read_picture(path, **options):
    return read_height_map(str(path), **{"size_um": SIZE_UM, "height_nm": HEIGHT_NM} | options)


@pytest.fixture
def fails(tmp_path):
    """Read a file of these bytes; the one line of the failure, which names file, fault and remedy."""

    def line_of(name, data, **options):
        path = tmp_path / name
        path.write_bytes(data)
        before = sorted(tmp_path.iterdir())
        with pytest.raises(GratingError) as caught:
            read_height_map(str(path), **options)
        line = str(caught.value)
        assert line.startswith(f"{path}: ")
        assert "; " in line
        assert "\n" not in line
        assert sorted(tmp_path.iterdir()) == before
        return line.removeprefix(f"{path}: ")

    return line_of


# Orientation and units


def test_one_tilted_surface_through_every_format(tmp_path):
    (tmp_path / "tilted.nid").write_bytes(nid_bytes(TILTED))
    (tmp_path / "tilted.gwy").write_bytes(gwy_bytes({"/0/data/title": "Height", "/0/data": TILTED}))
    maps = {
        "nid": (read_height_map(str(tmp_path / "tilted.nid")), 8e-7 / 2**32),
        "gwy": (read_height_map(str(tmp_path / "tilted.gwy")), 0),
        "png 16": (read_picture(picture(tmp_path / "16.png", GREY16)), HALF_STEP_16),
        "png 8": (read_picture(picture(tmp_path / "8.png", GREY8)), HALF_STEP_8),
        "tiff 16": (read_picture(picture(tmp_path / "16.tif", GREY16)), HALF_STEP_16),
        "tiff 8": (read_picture(picture(tmp_path / "8.tiff", GREY8, compression="tiff_lzw")), HALF_STEP_8),
        "bmp": (read_picture(picture(tmp_path / "8.bmp", GREY8)), HALF_STEP_8),
    }
    for name, (hm, rounding) in maps.items():
        # Half a quantisation step, and the rounding of the scale factors.
        np.testing.assert_allclose(hm.height_m, TILTED, rtol=0, atol=rounding + 1e-21, err_msg=name)
        assert hm.pixel_size_m == pytest.approx((PIXEL_M, PIXEL_M), rel=1e-12), name
        assert not hm.periodic


def test_the_real_grid_is_the_same_through_four_files(shared_data):
    folder = shared_data / "nanosurf"
    nid = read_height_map(str(folder / "grid.nid"))
    gwy = read_height_map(str(folder / "grid.gwy"))
    png = read_height_map(str(folder / "grid_16bit.png"), size_um=3.0, height_nm=302.626506663)
    np.testing.assert_allclose(nid.height_m, gwy.height_m, rtol=1e-12)
    # The text has seven digits of numbers up to 1.2 um.
    np.testing.assert_allclose(nid.height_m, np.loadtxt(folder / "grid_gwyddion.txt"), rtol=0, atol=0.6e-12)
    # The picture starts at its own lowest pixel, in steps of 302.6 nm / 65535.
    above_lowest = nid.height_m - nid.height_m.min()
    np.testing.assert_allclose(above_lowest, png.height_m, rtol=0, atol=0.51 * 302.63e-9 / 65535)
    assert nid.pixel_size_m == gwy.pixel_size_m == png.pixel_size_m == (3e-6 / 256, 3e-6 / 256)
    assert (nid.channel, gwy.channel) == ("Z-Axis forward", "Z-Axis")


def test_the_real_skin_is_grey_in_rgba(shared_data):
    hm = read_height_map(str(shared_data / "snake" / "elaphe_65um.png"), size_um=65, height_nm=375)
    assert (hm.rows, hm.cols) == (1332, 1332)
    assert np.ptp(hm.height_m) == pytest.approx(375e-9, rel=1e-12)


def test_the_compressed_palette_bmp_is_grey(shared_data):
    hm = read_height_map(str(shared_data / "snake" / "blaze200_synthetic.bmp"), size_um=2.5, height_nm=246.23)
    facet = hm.height_m[0, :-1]
    assert (np.diff(facet) > 0).all()


# Pictures


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
    with pytest.raises(GratingError, match="2 pictures"):
        read_picture(tmp_path / "pages.tif")


@pytest.mark.parametrize("name", ["st_example_ps.tiff", "afmreader_sample_0.jpk"])
def test_instrument_files_in_a_tiff_are_not_taken_for_pictures(shared_data, name):
    with pytest.raises(GratingError, match="Park|pictures"):
        read_picture(shared_data / "formats" / name)


# Nanosurf


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


def test_the_topography_is_found_behind_its_sensor(tmp_path):
    path = tmp_path / "sensor.gwy"
    titles = {"/0/data/title": "Height Sensor", "/1/data/title": "Height"}
    path.write_bytes(gwy_bytes(titles | {"/0/data": -TILTED, "/1/data": TILTED}))
    assert read_height_map(str(path)).channel == "Height"


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


# Gwyddion


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
    assert "--channel" in fails("volts.gwy", gwy_bytes({"/0/data/title": "Height", "/0/data": volts}))
    with pytest.raises(GratingError, match="no channel is plainly the topography"):
        read_height_map(str(shared_data / "formats" / "gwyfile_test.gwy"))


def test_gwy_that_is_not_whole(fails):
    data = gwy_bytes({"/0/data/title": "Height", "/0/data": TILTED})
    assert "truncated" in fails("short.gwy", data[:-1])
    assert "truncated" in fails("empty.gwy", b"GWYP")
    wide = data.replace(b"xres\0i" + struct.pack("<i", COLS), b"xres\0i" + struct.pack("<i", 10**9))
    assert "damaged" in fails("size.gwy", wide)
    # gwyfile itself would never return from a string without an end.
    endless = b"x\0s" + b"no end"
    assert "no end" in fails("endless.gwy", b"GWYPGwyContainer\0" + struct.pack("<I", len(endless)) + endless)
    nested = b""
    for _ in range(5000):
        nested = b"x\0oGwyContainer\0" + struct.pack("<I", len(nested)) + nested
    assert "damaged" in fails("nested.gwy", b"GWYPGwyContainer\0" + struct.pack("<I", len(nested)) + nested)


# The registry


def test_magic_decides_and_a_lying_extension_is_told(fails, tmp_path):
    assert "rename it to .nid" in fails("scan.png", nid_bytes(TILTED), size_um=1, height_nm=1)
    assert "does not begin like Nanosurf" in fails("scan.nid", b"something else entirely")
    assert ".png, .tif, .tiff, .bmp, .nid, .gwy" in fails("scan.xyz", b"something else entirely")
    (tmp_path / "no_extension").write_bytes(nid_bytes(TILTED))
    assert read_height_map(str(tmp_path / "no_extension")).channel == "Z-Axis forward"


@pytest.mark.parametrize("extension", [each for format_ in FORMATS for each in format_.extensions])
def test_an_empty_file_a_directory_and_a_missing_file(fails, tmp_path, extension):
    assert "empty" in fails(f"none{extension}", b"", size_um=1, height_nm=1)
    (tmp_path / f"folder{extension}").mkdir()
    with pytest.raises(GratingError, match="is a directory; "):
        read_height_map(str(tmp_path / f"folder{extension}"))
    with pytest.raises(GratingError, match="cannot be read .*; "):
        read_height_map(str(tmp_path / f"missing{extension}"))


def test_sizes_are_refused_where_they_would_be_ignored(fails):
    told = fails("scan.nid", nid_bytes(TILTED), size_um=1, height_nm=1)
    assert "leave out --size-um and --height-nm" in told
    with pytest.raises(GratingError, match="sample:blazed: .*leave out --size-um"):
        read_height_map("sample:blazed", size_um=65)


def picture_bytes(path):
    return open(picture(path, GREY8), "rb").read()


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(["nid", "gwy", "png", "tif", "bmp"]), st.integers(0, 2**32), st.booleans())
def test_a_damaged_file_is_read_or_refused_and_never_more(tmp_path_factory, kind, seed, cut):
    """Cut anywhere, or with some bytes overwritten, mostly in the header."""
    folder = tmp_path_factory.getbasetemp()
    whole = {"nid": nid_bytes(TILTED), "gwy": gwy_bytes({"/0/data/title": "Height", "/0/data": TILTED})}.get(
        kind
    ) or picture_bytes(folder / f"whole.{kind}")
    rng = np.random.default_rng(seed)
    data = bytearray(whole[: rng.integers(1, len(whole))] if cut else whole)
    for place in [] if cut else rng.integers(min(len(data), 2000), size=rng.integers(1, 6)):
        data[place] = rng.integers(256)
    path = folder / f"damaged.{kind}"
    path.write_bytes(data)
    sizes = {} if kind in ("nid", "gwy") else {"size_um": 1.0, "height_nm": 200.0}
    try:
        hm = read_height_map(str(path), **sizes)
    except GratingError as error:
        assert str(error).startswith(f"{path}: ") and "; " in str(error) and "\n" not in str(error)
    else:
        assert hm.height_m.size <= 1400 * 8 * len(data)
