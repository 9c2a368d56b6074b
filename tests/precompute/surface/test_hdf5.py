# SPDX-License-Identifier: GPL-3.0-or-later
"""HDF5 files of microscopes: frames, directions, calibrations, and malformed structures."""

import io
import re
import struct
import zlib

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.readers.hdf5_file import Dataset, Structures
from precompute.surface.readers.reader_registry import read_height_map
from tests.hostile import hdf5
from tests.hostile.instruments import SPAN_M
from tests.precompute.surface.scan_files import PIXEL_M, TILTED

HEIGHTS = TILTED - 100e-9
HALF_STEP = SPAN_M / 2**33 * 1.001


def write(folder, name, data):
    path = folder / name
    path.write_bytes(data)
    return str(path)


def test_frames_of_a_jpk_movie_are_channels(tmp_path):
    path = write(tmp_path, "movie.h5-jpk", hdf5.h5_jpk(HEIGHTS, PIXEL_M))
    names = ("Height retrace", "Height trace", "Lock-In Amplitude trace")
    assert read_height_map(path).channels == tuple(f"{name} {frame}" for frame in (1, 2) for name in names)
    np.testing.assert_allclose(read_height_map(path).height_m, HEIGHTS, atol=HALF_STEP)
    np.testing.assert_allclose(read_height_map(path, channel="height trace 2").height_m, HEIGHTS / 2, atol=HALF_STEP)
    np.testing.assert_allclose(read_height_map(path, channel="height retrace").height_m, -HEIGHTS, atol=HALF_STEP)


def test_a_jpk_scan_of_one_frame_names_no_frame(tmp_path):
    path = write(tmp_path, "scan.h5-jpk", hdf5.h5_jpk(HEIGHTS, PIXEL_M, reflected=True, frames=1))
    assert read_height_map(path).channels == ("Height retrace", "Height trace", "Lock-In Amplitude trace")
    np.testing.assert_allclose(read_height_map(path).height_m, HEIGHTS, atol=HALF_STEP)


@pytest.mark.parametrize("version", [1, 2])
def test_channels_of_nanosurf_studio(tmp_path, version):
    path = write(tmp_path, "studio.nhf", hdf5.nhf(HEIGHTS, PIXEL_M, version=version))
    names = ("Z-Controller In", "Topography", "Wave")
    listed = tuple(f"{name} {direction}" for direction in ("forward", "backward") for name in names)
    assert read_height_map(path).channels == listed
    back = read_height_map(path, channel="Topography backward")
    np.testing.assert_allclose(back.height_m, -HEIGHTS, atol=2 * HALF_STEP)
    with pytest.raises(GratingError, match="'Wave forward' holds curves, not an image"):
        read_height_map(path, channel="Wave")
    with pytest.raises(GratingError, match="'Z-Controller In forward' is in 'V', not in metres"):
        read_height_map(path, channel="Z-Con")


def test_a_nanosurf_calibration_that_is_another_is_told(tmp_path):
    facts = {"signal_id": "z", "signal_selected": "z linearised"}
    path = write(tmp_path, "calibrated.nhf", hdf5.nhf(HEIGHTS, PIXEL_M, version=2, more=facts))
    with pytest.raises(GratingError, match="'the calibration 'z linearised'', not in metres"):
        read_height_map(path, channel="Topography")


def test_a_nanosurf_scan_that_was_broken_off_is_refused(fails):
    """Version 1 has no number for a missing point."""
    whole = hdf5.nhf(HEIGHTS, PIXEL_M, acquired=9)
    assert "9 of 24 lines were scanned" in fails("begun.nhf", whole)


def test_other_hdf5_is_told(fails):
    out = hdf5.Writer()
    assert "neither a Nanosurf nor a JPK file" in fails("other.nhf", out.whole(out.group({}, {"title": "data"})))
    out = hdf5.Writer()
    new = out.whole(out.group({}, {"nsf_file_version_major": 3}))
    assert "a .nhf of version 3" in fails("new.nhf", new)


def spoiled(mark, form, *values, after=0, last=False):
    """A .nhf with numbers written `after` bytes behind the first or last occurrence of a mark."""
    whole = bytearray(hdf5.nhf(HEIGHTS, PIXEL_M, packed=True))
    at = whole.rindex(mark) if last else whole.index(mark)
    struct.pack_into(form, whole, at + after, *values)
    return bytes(whole)


@pytest.mark.parametrize(
    "whole, told",
    [
        (hdf5.nhf_continued_in_a_circle, "in a circle"),
        # The root's tree, which is the last one, gets levels and itself as its first child.
        (lambda: in_itself(), "in a circle"),
        (lambda: spoiled(b"\x89HDF", "<B", 7, after=8), "superblock of version 7"),
        (lambda: spoiled(b"\x89HDF", "<B", 4, after=13), "other sizes of addresses"),
        (lambda: spoiled(b"SNOD", "<B", 0, last=True), "no HDF5 symbols"),
        (lambda: spoiled(b"HEAP", "<B", 0, last=True), "no HDF5 heap"),
        (lambda: spoiled(b"TREE", "<B", 0, last=True), "no HDF5 tree"),
        (lambda: spoiled(b"GCOL", "<H", 9, after=16), "an HDF5 text is missing"),
        (lambda: spoiled(b"\1\2\0\0\0\0\0\0\2\0", "<H", 32000, after=8), "HDF5 filter 32000"),
    ],
)
def test_structures_that_lead_nowhere(fails, whole, told):
    assert told in fails("odd.nhf", whole())


def in_itself():
    whole = bytearray(hdf5.nhf(HEIGHTS, PIXEL_M))
    at = whole.rindex(b"TREE")
    struct.pack_into("<2BH16x2Q", whole, at + 4, 0, 1, 1, 0, at)
    return bytes(whole)


def test_a_chunk_that_unpacks_to_more_than_it_says(fails):
    """10 MB of zeros in a chunk of 40 integers of 4 bytes."""
    whole = bytearray(hdf5.nhf(HEIGHTS, PIXEL_M, packed=True))
    bomb = zlib.compress(bytes(10_000_000))
    # The keys of the second tree (the topography): bytes of the chunk, omitted filters, place; then its address.
    at = [found.start() for found in re.finditer(rb"TREE\x01", whole)][1]
    struct.pack_into("<I", whole, at + 24, len(bomb))
    struct.pack_into("<Q", whole, at + 24 + 24, len(whole))
    assert "an HDF5 chunk unpacks to more than its 160 bytes" in fails("bomb.nhf", bytes(whole) + bomb)


@pytest.mark.parametrize("stored, told", [(0, "a chunk of 1600 bytes in 0"), (2**32 - 1, "bytes are missing")])
def test_the_length_of_a_chunk_is_judged_before_memory_is_taken(fails, stored, told):
    """Deflate packs at most 1032 bytes into one, and no chunk is longer than its file."""
    whole = bytearray(hdf5.nhf(np.zeros((8, 400)), PIXEL_M, packed=True))
    at = [found.start() for found in re.finditer(rb"TREE\x01", whole)][1]
    struct.pack_into("<I", whole, at + 24, stored)
    assert told in fails("chunk.nhf", bytes(whole))


def test_values_that_no_file_of_so_few_bytes_holds():
    file = io.BytesIO(bytes(1000))
    dataset = Dataset(Structures(file), (20_000_000,), np.dtype("<i4"), struct.pack("<2B2Q", 3, 1, 0, 8), (1,))
    with pytest.raises(ValueError, match="80000000 bytes of values in a file of 1000"):
        dataset.read(file)
