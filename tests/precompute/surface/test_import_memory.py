# SPDX-License-Identifier: GPL-3.0-or-later
"""The memory of a large import, as the dialog and `info` do it, in a process of its own."""

import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image

_IMPORT = """
import sys
from precompute.bake.make import peak_bytes
from precompute.surface.quality import describe
from precompute.surface.readers.reader_registry import read_height_map
before = peak_bytes()
height_map = read_height_map(sys.argv[1], 200.0, 300.0)
describe(height_map)
print((peak_bytes() - before) / height_map.height_m.nbytes)
"""
TIMES_MAX = 3.0  # the aim of an import


def test_an_import_takes_at_most_three_times_the_heights(tmp_path):
    """Of a picture of 4096 x 4096 pixels of 16 bits."""
    wave = (30000 + 20000 * np.sin(np.arange(4096) / 20)).astype(np.uint16)
    Image.fromarray(np.tile(wave, (4096, 1))).save(tmp_path / "large.png", compress_level=1)
    root = Path(__file__).resolve().parents[3]
    command = [sys.executable, "-c", _IMPORT, str(tmp_path / "large.png")]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    assert 1 < float(done.stdout) <= TIMES_MAX
