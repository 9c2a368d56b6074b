# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of instruments: one surface in every format, its channels, and damaged files."""

import io
import struct
import zipfile
from functools import partial

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.readers.reader_registry import read_height_map, reader_of
from tests.hostile import hdf5, instruments, microscopes
from tests.hostile.instruments import SPAN_M
from tests.precompute.surface.scan_files import COLS, PIXEL_M, ROWS, SIZE_UM, TILTED

# Not square and centred on zero, so that a swapped axis or a lost sign shows.
HEIGHTS = TILTED - 100e-9
# For each format: the maker of a file, its extension, the label of the topography, and half a step of its numbers.
FORMATS = {
    "nanoscope": (instruments.nanoscope, ".spm", "ZSensor trace", SPAN_M / 2**17),
    "nanoscope of 32 bits": (
        partial(instruments.nanoscope, stored="<i4", declared=2), ".007", "ZSensor trace", SPAN_M / 2**17
    ),
    "nanoscope of 32 bits declared": (
        partial(instruments.nanoscope, stored="<i4", declared=4), ".di", "ZSensor trace", SPAN_M / 2**33
    ),
    "nanoscope of version 5": (instruments.nanoscope_5, ".spm", "ZSensor trace", SPAN_M / 2**17),
    # Single precision has 24 bits.
    "ibw": (instruments.ibw, ".ibw", "Height trace", 100e-9 / 2**24),
    "ibw of big-endian numbers": (partial(instruments.ibw, order=">"), ".ibw", "Height trace", 100e-9 / 2**24),
    "jpk": (instruments.jpk, ".jpk", "Height trace", SPAN_M / 2**33),
    "park": (instruments.park, ".tiff", "Z Height forward", 1e-6 / 2**23),
    "park of version 1": (partial(instruments.park, version=1), ".tiff", "Z Height forward", SPAN_M / 2**17),
    # The highest and the lowest integer, which set the scale, are rounded too.
    "wsxm": (instruments.wsxm, ".top", "Topography forward", 1.5 * 200e-9 / 60000),
    "wsxm of doubles": (partial(instruments.wsxm, kind="double"), ".stp", "Topography forward", 0),
    "agilent": (instruments.agilent, ".mi", "Topography trace", SPAN_M / 2**33),
    "nt-mdt": (microscopes.ntmdt, ".mdt", "Height forward", SPAN_M / 2**17),
    "nt-mdt of mda frames": (microscopes.ntmdt_mda, ".mdt", "Height forward", 0),
    "nt-mdt of 16-bit mda frames": (
        partial(microscopes.ntmdt_mda, kind="<i2"), ".mdt", "Height forward", SPAN_M / 2**17
    ),
    "nanonis": (microscopes.sxm, ".sxm", "Z forward", 100e-9 / 2**24),
    "nanonis, downward": (partial(microscopes.sxm, upward=False), ".sxm", "Z forward", 100e-9 / 2**24),
    "nhf": (hdf5.nhf, ".nhf", "Topography forward", SPAN_M / 2**32),
    "nhf of version 2": (partial(hdf5.nhf, version=2, packed=True), ".nhf", "Topography forward", SPAN_M / 2**32),
    "h5-jpk": (hdf5.h5_jpk, ".h5-jpk", "Height trace 1", SPAN_M / 2**33),
    "h5-jpk, reflected": (partial(hdf5.h5_jpk, reflected=True), ".h5-jpk", "Height trace 1", SPAN_M / 2**33),
    "asd": (microscopes.asd, ".asd", "Topography 1", SPAN_M / 2**16),
    "asd of one frame": (partial(microscopes.asd, version=2, frames=1), ".asd", "Topography", SPAN_M / 2**16),
    "gsf": (instruments.gsf, ".gsf", "Topography", 100e-9 / 2**24),
    "text": (instruments.gwyddion_text, ".txt", "Topography", 1e-19),
    "text in German": (partial(instruments.gwyddion_text, german=True), ".txt", "Topography", 1e-19),
    "sur": (instruments.digital_surf, ".sur", "height", SPAN_M / 2**32),
    "sur of 16 bits": (partial(instruments.digital_surf, bits=16), ".sur", "height", SPAN_M / 2**17),
    "sur, packed": (partial(instruments.digital_surf, packed=True), ".pro", "height", SPAN_M / 2**32),
    "sdf": (instruments.sdf, ".sdf", "height", 0),
    # Ten digits of up to 100 nm.
    "sdf as text": (partial(instruments.sdf, text=True), ".sdf", "height", 1e-17),
    "x3p": (instruments.x3p, ".x3p", "height", 0),
    "x3p, not packed": (partial(instruments.x3p, packed=False), ".x3p", "height", 0),
    "x3p of points in its XML": (instruments.x3p_listed, ".x3p", "height", 0),
    "x3p of integers": (partial(instruments.x3p, kind="L"), ".x3p", "height", 0.5e-12),
}  # fmt: skip
# Bare numbers: nanometres, in text with nine digits after the point.
BARE = {
    "xyz": (instruments.xyz, ".xyz", 0.5e-18),
    "matrix": (instruments.matrix, ".asc", 0.5e-18),
    "npy": (instruments.npy, ".npy", 0),
    # Single precision of up to 100 nm.
    "exr": (instruments.exr, ".exr", 100e-9 / 2**24),
}
KEEP_MISSING = ("sur", "sdf", "sdf as text", "x3p", "x3p of integers", "gsf", "nanonis", "nhf of version 2")


def write(folder, name, data):
    path = folder / name
    path.write_bytes(data)
    return str(path)


@pytest.mark.parametrize("name", FORMATS)
def test_one_surface_through_every_instrument(tmp_path, name):
    make, extension, label, half_step = FORMATS[name]
    path = write(tmp_path, f"tilted{extension}", make(HEIGHTS, PIXEL_M))
    height_map = read_height_map(path)
    # Besides half a step, the scale is rounded, in Digital Surf's headers to single precision.
    np.testing.assert_allclose(height_map.height_m, HEIGHTS, rtol=1e-7, atol=half_step * 1.001 + 1e-21)
    assert height_map.pixel_size_m == pytest.approx((PIXEL_M, PIXEL_M), rel=1e-7)
    assert height_map.channel == label
    assert tuple(channel.label for channel in reader_of(path).channels(path)) == height_map.channels


@pytest.mark.parametrize("name", BARE)
def test_one_surface_through_bare_numbers(tmp_path, name):
    make, extension, half_step = BARE[name]
    path = write(tmp_path, f"tilted{extension}", make(HEIGHTS, PIXEL_M))
    height_map = read_height_map(path, SIZE_UM, 1.0)
    np.testing.assert_allclose(height_map.height_m, HEIGHTS, rtol=1e-14, atol=half_step * 1.001)
    assert height_map.pixel_size_m == pytest.approx((PIXEL_M, PIXEL_M), rel=1e-9)
    assert reader_of(path).channels(path) == ()
    with pytest.raises(GratingError, match="--height-nm, the height of the number 1"):
        read_height_map(path, SIZE_UM)
    with pytest.raises(GratingError, match="leave out --channel"):
        read_height_map(path, SIZE_UM, 1.0, channel="height")


@pytest.mark.parametrize("name", KEEP_MISSING)
def test_missing_points_are_missing(tmp_path, name):
    make, extension, *_ = FORMATS[name]
    holed = HEIGHTS.copy()
    holed[2, 7] = np.nan
    height_map = read_height_map(write(tmp_path, f"holed{extension}", make(holed, PIXEL_M)))
    assert np.argwhere(np.isnan(height_map.height_m)).tolist() == [[2, 7]]


@pytest.mark.parametrize("hole", [np.finfo("f8").max, -np.finfo("f8").max, np.inf, np.nan])
def test_the_largest_number_is_a_missing_point_in_sdf(tmp_path, hole):
    """Programs mark a hole by DBL_MAX, which a text may round up to infinity."""
    height = HEIGHTS * 1e9
    height[2, 7] = hole
    head = instruments.sdf(HEIGHTS, PIXEL_M)[: -8 * HEIGHTS.size]
    text = instruments.sdf(HEIGHTS, PIXEL_M, text=True).split(b"*")[0]
    body = "\n".join(" ".join(f"{value:.6g}" for value in row) for row in height).encode()
    for whole in (head + height.tobytes(), text + b"*\n" + body + b"\n*\n*"):
        found = read_height_map(write(tmp_path, "holed.sdf", whole)).height_m
        assert np.argwhere(np.isnan(found)).tolist() == [[2, 7]]


def test_missing_points_of_a_grid_are_missing(tmp_path):
    holed = HEIGHTS.copy()
    holed[2, 7] = np.nan
    path = write(tmp_path, "holed.xyz", instruments.xyz(holed, PIXEL_M))
    with pytest.raises(GratingError, match="its numbers have no unit; give --size-um"):
        read_height_map(path)
    height_map = read_height_map(path, SIZE_UM, 1.0)
    assert np.argwhere(np.isnan(height_map.height_m)).tolist() == [[2, 7]]


@pytest.mark.parametrize(
    "name, listed",
    [
        ("nanoscope", ("ZSensor trace", "Height retrace", "Phase trace")),
        ("ibw", ("Height trace", "Height retrace", "Phase trace")),
        ("jpk", ("Height retrace", "Height trace", "Lock-In Amplitude trace")),
        ("agilent", ("Deflection trace", "Topography retrace", "Topography trace")),
    ],
)
def test_trace_and_retrace_are_told_apart(tmp_path, name, listed):
    make, extension, label, half_step = FORMATS[name]
    path = write(tmp_path, f"several{extension}", make(HEIGHTS, PIXEL_M))
    assert read_height_map(path).channels == listed
    back = next(each for each in listed if "retrace" in each)
    np.testing.assert_allclose(read_height_map(path, channel=back).height_m, -HEIGHTS, rtol=1e-7, atol=half_step)
    other = next(each for each in listed if each.startswith(("Phase", "Deflection", "Lock-In")))
    if other.startswith("Lock-In"):
        assert read_height_map(path, channel=other).channel == other
    else:
        with pytest.raises(GratingError, match="not in metres; name a height channel"):
            read_height_map(path, channel=other)


def test_a_jpk_channel_without_its_scaling_is_left_out_alone(tmp_path):
    whole = instruments.jpk(HEIGHTS, PIXEL_M)
    # The default slot of the last channel, an amplitude.
    at = whole.rindex(b"nominal\0", 0, whole.rindex(b"nominal\0"))
    path = write(tmp_path, "slot.jpk", whole[:at] + b"another" + whole[at + 7 :])
    assert read_height_map(path).channel == "Height trace"
    with pytest.raises(GratingError, match="'Lock-In Amplitude trace' is in 'an unknown unit', not in metres; "):
        read_height_map(path, channel="Lock-In")


def test_what_is_no_topography_is_never_taken_for_it(fails, tmp_path):
    """The file holds only an amplitude, in metres."""
    whole = instruments.ibw(HEIGHTS, PIXEL_M, labels=("AmplitudeTrace", "DeflectionTrace", "PhaseTrace"))
    assert "it is unclear which channel is the topography" in fails("amplitude.ibw", whole)
    chosen = read_height_map(write(tmp_path, "named.ibw", whole), channel="Amplitude")
    np.testing.assert_allclose(chosen.height_m, HEIGHTS, rtol=1e-6, atol=1e-14)


def test_channels_of_one_name_are_told_apart_by_their_numbers(tmp_path):
    labels = ("HeightTrace", "HeightTrace", "PhaseTrace")
    path = write(tmp_path, "twice.ibw", instruments.ibw(HEIGHTS, PIXEL_M, labels=labels))
    assert read_height_map(path).channels == ("Height trace (1)", "Height trace (2)", "Phase trace")


def without_units(whole, *, order="<"):
    """An Igor wave whose values and sides have no unit."""
    spoiled = bytearray(whole)
    for at in (64 + 148, 64 + 152, 64 + 156):
        spoiled[at] = 0
    (old,) = struct.unpack_from(f"{order}H", spoiled, 2)
    spoiled[2:4] = struct.pack(f"{order}H", (old + 109 * 3) & 0xFFFF)
    return bytes(spoiled)


def test_a_wave_without_labels_or_units(fails):
    whole = instruments.ibw(HEIGHTS, PIXEL_M, labels=())
    assert "it is unclear which channel is the topography" in fails("bare.ibw", without_units(whole))


def test_an_asylum_wave_without_units_is_in_metres(tmp_path, fails):
    """Its note identifies it as Asylum's; without the note its numbers are not lengths."""
    whole = without_units(instruments.ibw(HEIGHTS, PIXEL_M))
    height_map = read_height_map(write(tmp_path, "units.ibw", whole))
    np.testing.assert_allclose(height_map.height_m, HEIGHTS, rtol=1e-6, atol=1e-14)
    assert height_map.pixel_size_m == pytest.approx((PIXEL_M, PIXEL_M), rel=1e-12)
    (note,) = struct.unpack_from("<i", whole, 12)
    at = len(whole) - 4 * 32 - note
    bare = bytearray(whole[:at] + whole[at + note :])
    bare[12:16] = bytes(4)
    bare[2:4] = struct.pack("<H", (struct.unpack_from("<H", bare, 2)[0] + note) & 0xFFFF)
    assert "no channel holds heights ('Height trace' has no unit" in fails("igor.ibw", bytes(bare))


@pytest.mark.parametrize("inversion, turned", [(1, -HEIGHTS), (2, -HEIGHTS[:, ::-1]), (3, -HEIGHTS[::-1])])
def test_what_digital_surf_inverted_is_turned_back(tmp_path, inversion, turned):
    whole = bytearray(instruments.digital_surf(HEIGHTS, PIXEL_M))
    struct.pack_into("<H", whole, 290, inversion)
    height_map = read_height_map(write(tmp_path, "inverted.sur", bytes(whole)))
    np.testing.assert_allclose(height_map.height_m, turned, rtol=1e-7, atol=SPAN_M / 2**32)


def test_a_sign_of_micrometres_in_utf8(tmp_path):
    """Latin-1 and UTF-8 encode it in one and two bytes."""
    for sign in (b"\xb5m", b"\xc2\xb5m"):
        whole = bytearray(instruments.digital_surf(HEIGHTS, PIXEL_M))
        for at, step_at in ((180, 120), (196, 124), (212, 128)):
            whole[at : at + 16] = sign.ljust(16)
            struct.pack_into("<f", whole, step_at, struct.unpack_from("<f", whole, step_at)[0] * 1e-3)
        height_map = read_height_map(write(tmp_path, "sign.sur", bytes(whole)))
        # Two factors in single precision.
        np.testing.assert_allclose(height_map.height_m, HEIGHTS, rtol=2e-7, atol=SPAN_M / 2**32)


def test_an_x3p_in_a_folder_is_found_and_what_macos_adds_is_not(tmp_path):
    whole = instruments.x3p(HEIGHTS, PIXEL_M, folder="scan 1/")
    out = io.BytesIO(whole)
    with zipfile.ZipFile(out, "a") as archive:
        archive.writestr("__MACOSX/scan 1/main.xml", b"nothing")
    height_map = read_height_map(write(tmp_path, "folder.x3p", out.getvalue()))
    np.testing.assert_allclose(height_map.height_m, HEIGHTS, rtol=1e-14)


def zipped(files):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return out.getvalue()


def test_archives_that_are_no_x3p(fails):
    assert "entities" in fails("laughs.x3p", zipped({"main.xml": b'<!DOCTYPE a [<!ENTITY b "c">]><a/>'}))
    assert "main.xml has" in fails("long.x3p", zipped({"main.xml": b" " * (65 << 20)}))
    assert "is missing" in fails("empty.x3p", zipped({"main.xml": b"<a/>"}))


def test_a_bomb_of_zeros_is_not_unpacked(fails):
    """40 MB of zeros where the header declares 24 x 40 points."""
    whole = zipfile.ZipFile(io.BytesIO(instruments.x3p(HEIGHTS, PIXEL_M)))
    bomb = zipped({"main.xml": whole.read("main.xml"), "bindata/data.bin": bytes(40_000_000)})
    assert "40000000 bytes are there" in fails("bomb.x3p", bomb)
    packed = bytearray(instruments.digital_surf(HEIGHTS, PIXEL_M, packed=True))
    struct.pack_into("<I", packed, 519 + 4, 40_000_000)
    assert "another number of values" in fails("bomb.sur", bytes(packed))


@pytest.mark.parametrize(
    "lines",
    [
        ("1;2;3;4;1;2;3;4", "5;6;7;8;5;6;7;8"),
        ("1,2,3,4,1,2,3,4", "5,6,7,8,5,6,7,8"),
        ("1.0, 2.0, 3.0, 4, 1, 2, 3, 4", "5, 6, 7, 8, 5, 6, 7, 8"),
        ("1,0\t2,0\t3,0\t4,0\t1\t2\t3\t4", "5\t6\t7\t8,0\t5\t6\t7\t8"),
    ],
)
def test_separators_and_decimal_commas_of_a_matrix(tmp_path, lines):
    text = "\n".join(4 * lines)
    height_map = read_height_map(write(tmp_path, "matrix.csv", text.encode()), 1.0, 1.0)
    np.testing.assert_allclose(
        height_map.height_m, np.tile([[1e-9, 2e-9, 3e-9, 4e-9], [5e-9, 6e-9, 7e-9, 8e-9]], (4, 2))
    )


def test_points_that_are_no_grid(fails):
    rng = np.random.default_rng(1)
    scattered = "".join(f"{x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in rng.random((50, 3)))
    assert "grid" in fails("scattered.xyz", scattered.encode(), size_um=1, height_nm=1)
    assert "line" in fails("line.xyz", b"0 0 1\n1 0 2\n2 0 3\n3 0 3\n", size_um=1, height_nm=1)


def test_pickles_and_other_arrays_are_refused(fails):
    arrays = {"objects": np.array([[{}]]), "deep": np.zeros((2, 2, 2)), "complex": np.ones((2, 2)) * 1j}
    for name, array in arrays.items():
        out = io.BytesIO()
        np.save(out, array)
        assert "no matrix of numbers" in fails(f"{name}.npy", out.getvalue(), size_um=1, height_nm=1)


def test_an_array_by_columns_is_the_same_array(tmp_path):
    np.save(tmp_path / "columns.npy", np.asfortranarray(HEIGHTS))
    height_map = read_height_map(str(tmp_path / "columns.npy"), SIZE_UM, 1e9)
    np.testing.assert_allclose(height_map.height_m, HEIGHTS, rtol=1e-15)


@pytest.mark.parametrize("name", FORMATS)
def test_a_file_that_is_cut_is_refused_in_one_line(fails, name):
    make, extension, *_ = FORMATS[name]
    whole = make(HEIGHTS, PIXEL_M)
    assert "; " in fails(f"half{extension}", whole[: len(whole) // 2])


@pytest.mark.parametrize("name", BARE)
def test_bare_numbers_that_are_cut_are_refused_in_one_line(fails, name):
    make, extension, _ = BARE[name]
    whole = make(HEIGHTS, PIXEL_M)
    assert "; " in fails(f"half{extension}", whole[: len(whole) // 2 - 300], size_um=1, height_nm=1)


def test_rows_and_columns_are_told_apart():
    assert HEIGHTS.shape == (ROWS, COLS)
