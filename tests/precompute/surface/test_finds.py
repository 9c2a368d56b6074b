# SPDX-License-Identifier: GPL-3.0-or-later
"""Files found by a fuzzer, reduced to their cause."""

import struct

import numpy as np
import pytest

from tests.hostile import instruments
from tests.precompute.surface.scan_files import PIXEL_M, TILTED, picture, read_picture

# A signalling NaN, for which NumPy warns when it converts to double.
SIGNAL = np.array([0x7F800001], np.uint32).view(np.float32)


@pytest.mark.parametrize("first", [2**63, 2**64 - 1])
def test_a_tiff_whose_directory_is_beyond_any_file(fails, first):
    """Python raises its own error for a position beyond any file."""
    told = fails("far.tif", b"II+\0\x08\0\0\0" + struct.pack("<Q", first), size_um=1, height_nm=1)
    assert "truncated or damaged" in told


@pytest.mark.parametrize("header", [b"{'descr': '<f8', 'shape': (24, 40", b"{'descr': '<f8'", b"(" * 64, b"\0" * 64])
def test_an_array_whose_header_is_cut(fails, header):
    """NumPy's parser passes on an error of Python's tokenizer."""
    whole = b"\x93NUMPY\1\0" + struct.pack("<H", len(header)) + header + bytes(960 * 8)
    assert "no matrix of numbers" in fails("cut.npy", whole, size_um=1, height_nm=1)


@pytest.mark.filterwarnings("error")
def test_a_nan_that_signals_is_a_missing_point_without_a_warning(tmp_path):
    whole = bytearray(instruments.exr(TILTED, PIXEL_M))
    whole[-4:] = SIGNAL.tobytes()
    (tmp_path / "signal.exr").write_bytes(bytes(whole))
    floats = TILTED.astype(np.float32)
    floats[-1, -1] = SIGNAL[0]
    picture(tmp_path / "signal.tif", floats)
    for name in ("signal.exr", "signal.tif"):
        assert np.argwhere(np.isnan(read_picture(tmp_path / name).height_m)).tolist() == [[23, 39]]
