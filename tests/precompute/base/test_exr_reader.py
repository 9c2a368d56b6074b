# SPDX-License-Identifier: GPL-3.0-or-later
"""The reader of OpenEXR files: what the library writes, and malformed files."""

import struct
import zlib

import numpy as np
import OpenEXR
import pytest

from precompute.base import exr_reader
from precompute.base.exr_reader import open_picture
from precompute.base.failure import GratingError


def written(path, image, **header):
    """Write an image, row 0 at the top, with the library OpenEXR."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, "told": "words", **header}
    with OpenEXR.File(header, {"RGBA"[: image.shape[2]]: np.ascontiguousarray(image)}) as file:
        file.write(str(path))
    return path


def noise(shape, kind=np.float16, seed=0):
    """Numbers that ZIP can compress."""
    return np.round(np.random.default_rng(seed).normal(0, 9, shape)).astype(kind)


@pytest.fixture
def bytes_of_one(tmp_path):
    """The bytes of a file of 40 x 30 texels, in two blocks."""
    return bytearray(written(tmp_path / "whole.exr", noise((30, 40, 3))).read_bytes())


def told_of(path, data, read=lambda path: open_picture(path).pixels()):
    """The error line with which bytes are refused."""
    path.write_bytes(data)
    with pytest.raises(GratingError) as caught:
        read(path)
    line = str(caught.value)
    assert line.startswith(f"{path}: ") and "; " in line
    return line


@pytest.mark.parametrize("kind", [np.float16, np.float32])
@pytest.mark.parametrize("shape", [(1, 1, 3), (16, 7, 3), (17, 5, 4), (31, 33, 3), (32, 9, 4)])
def test_what_the_library_writes_comes_back(tmp_path, capfd, kind, shape):
    image = noise(shape, kind)
    picture = open_picture(written(tmp_path / "a.exr", image))
    assert (picture.shape, picture.precision, picture.texts["told"]) == (shape, kind, b"words")
    np.testing.assert_array_equal(picture.pixels(), image[::-1])
    picture.check_pixels()
    assert capfd.readouterr() == ("", "")


def test_a_block_that_zip_does_not_shorten_comes_back(tmp_path):
    bits = np.random.default_rng(0).integers(0, 0x7BFF, (20, 50, 3), dtype=np.uint16)
    picture = open_picture(written(tmp_path / "a.exr", bits.view(np.float16)))
    np.testing.assert_array_equal(picture.pixels().view(np.uint16), bits[::-1])


@pytest.mark.parametrize("share", np.linspace(0, 0.99, 40))
def test_a_truncated_file_is_refused(tmp_path, bytes_of_one, share, capfd):
    told_of(tmp_path / "a.exr", bytes_of_one[: int(share * len(bytes_of_one))])
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e5])
@pytest.mark.parametrize("kind", [np.float16, np.float32])
def test_a_pixel_that_is_no_number_is_refused(tmp_path, value, kind):
    image = noise((40, 8, 3), kind)
    with np.errstate(over="ignore"):
        image[33, 5, 1] = value
    path = written(tmp_path / "a.exr", image)
    for read in (lambda path: open_picture(path).pixels(), lambda path: open_picture(path).check_pixels()):
        assert "not numbers" in told_of(path, path.read_bytes(), read)


def with_window(data, *corners, which=b"dataWindow"):
    at = data.index(which + b"\0box2i\0") + len(which) + 11
    return data[:at] + struct.pack("<4i", *corners) + data[at + 16 :]


@pytest.mark.parametrize("corners", [
    (0, 0, 10**9 - 1, 10**9 - 1), (0, 0, 2**31 - 1, 2**31 - 1), (0, 0, 16383, 16383), (0, 0, 39, 10**8), (0, 0, -2, 29),
    (5, 5, 44, 34), (-(2**31), 0, 2**31 - 1, 29), (0, 0, 38, 29), (0, 0, 39, 30), (0, 0, 39, 40),
])  # fmt: skip
@pytest.mark.parametrize("both", [True, False])
def test_windows_that_lie_are_refused(tmp_path, bytes_of_one, corners, both, monkeypatch):
    """The refusal comes before memory is reserved: a file of 5 kilobytes cannot hold 16384 x 16384 pixels."""
    if max(corners) > 1000:
        monkeypatch.setattr(np, "empty", None)
    data = with_window(bytes_of_one, *corners)
    told_of(tmp_path / "a.exr", with_window(data, *corners, which=b"displayWindow") if both else data)


def test_heads_of_other_kinds_are_refused(tmp_path, bytes_of_one):
    path = tmp_path / "a.exr"
    for flag in (0x2, 0x4, 0x8, 0x10):  # tiles, long names, deep, several parts
        told_of(path, bytes_of_one[:5] + bytes([flag]) + bytes_of_one[6:])
    for name, size in ((b"compression", 1), (b"lineOrder", 1)):
        at = bytes_of_one.index(name + b"\0" + name) + 2 * len(name) + 6
        assert "another OpenEXR file" in told_of(path, bytes_of_one[:at] + b"\1" * size + bytes_of_one[at + size :])
    image = noise((8, 8, 3))
    for compression in (OpenEXR.NO_COMPRESSION, OpenEXR.PIZ_COMPRESSION, OpenEXR.DWAA_COMPRESSION):
        assert "another OpenEXR file" in told_of(path, written(path, image, compression=compression).read_bytes())


@pytest.mark.parametrize("channels", [
    {"Y": np.float16}, {"R": np.float16, "G": np.float16}, {"R": np.float16, "G": np.float32, "B": np.float16},
    {"R": np.uint32, "G": np.uint32, "B": np.uint32}, {"X": np.float16, "Y": np.float16, "Z": np.float16},
])  # fmt: skip
def test_other_channels_are_refused(tmp_path, channels):
    path = tmp_path / "a.exr"
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {name: np.ones((8, 8), kind) for name, kind in channels.items()}) as file:
        file.write(str(path))
    assert "another OpenEXR file" in told_of(path, path.read_bytes())


def test_heads_without_end_are_refused(tmp_path, bytes_of_one):
    path, at = tmp_path / "a.exr", bytes_of_one.index(b"told\0string\0")
    before, after = bytes_of_one[:at], bytes_of_one[at:]
    many = b"".join(b"a%d\0string\0" % n + struct.pack("<i", 2) + b"{}" for n in range(100_000))
    for more in (
        many,
        b"name" * 100,
        b"big\0string\0" + struct.pack("<i", 2**31 - 1),
        b"less\0string\0" + struct.pack("<i", -1),
        b"channels\0chlist\0" + struct.pack("<i", 0),
        b"\xff\xfe\0string\0" + struct.pack("<i", 0),
    ):
        assert "not a readable" in told_of(path, before + more + after)


@pytest.mark.parametrize("place", [0, -1, 2**62, 2**63 - 1, 7])
def test_blocks_that_are_elsewhere_are_refused(tmp_path, bytes_of_one, place):
    at = open_picture(tmp_path / "whole.exr").table_at
    told_of(tmp_path / "a.exr", bytes_of_one[:at] + struct.pack("<q", place) + bytes_of_one[at + 8 :])


@pytest.mark.parametrize("packed", [zlib.compress(bytes(1 << 20)), zlib.compress(b"short"), b"no zip at all", b""])
def test_blocks_of_another_size_are_refused(tmp_path, bytes_of_one, packed):
    at = open_picture(tmp_path / "whole.exr").table_at
    block = struct.pack("<2i", 0, len(packed)) + packed
    table = struct.pack("<q", len(bytes_of_one))
    told_of(tmp_path / "a.exr", bytes_of_one[:at] + table + bytes_of_one[at + 8 :] + block)


def test_what_is_no_file_is_refused(tmp_path):
    with pytest.raises(GratingError, match="no such file"):
        open_picture(tmp_path / "none.exr")
    with pytest.raises(GratingError, match="no such file"):
        open_picture(tmp_path)


def test_the_largest_picture_is_that_of_the_largest_bake():
    from precompute.bake.make import ATLAS_BYTES_MAX

    assert exr_reader.TEXELS_MAX * 16 == ATLAS_BYTES_MAX
