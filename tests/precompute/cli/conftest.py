# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by tests of the command line: a picture and a bake."""

import numpy as np
import pytest
from PIL import Image

from precompute.table import atlas
from precompute.table.table import Table

PICTURE = ("--size-um", "4", "--height-nm", "250")
# A coherence length at which the picture, 4 um wide, has a small table.
SHORT = ("--coherence-um", "4")
# A coarse bake of one wavelength, in a third of the time of daylight.
LASER = ("--delta-e", "5", "--illuminant", "532nm")


@pytest.fixture
def scan(tmp_path):
    """A grey picture of an irregular grating, 48 x 48 pixels, in its own folder."""
    folder = tmp_path / "scans"
    folder.mkdir()
    x, y = np.meshgrid(*[np.arange(48) / 48] * 2)
    grey = 127 + 90 * np.sin(2 * np.pi * 5 * x + np.sin(2 * np.pi * y)) + 30 * np.cos(2 * np.pi * 3 * y)
    Image.fromarray(grey.astype(np.uint8)).save(folder / "skin.png")
    return folder / "skin.png"


@pytest.fixture
def small_bake(tmp_path):
    """The file of a bake of 4 tiles of 256 texels a side, each of one colour."""
    tiles = np.ones((4, 256, 256, 3), np.float32) * np.array([4, 3, 2, 1])[:, None, None, None]
    table = Table(tiles, np.full((512, 3), 0.5), 0.05, 4 / 252, "D65")
    (tmp_path / "bakes").mkdir()
    path = tmp_path / "bakes" / "small.exr"
    atlas.write_together({path: atlas.pack(table)}, {"source": "small"})
    return path
