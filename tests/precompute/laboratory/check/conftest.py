# SPDX-License-Identifier: GPL-3.0-or-later
"""A scan whose bakes are checked."""

import numpy as np
import pytest
from PIL import Image


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("check")


@pytest.fixture(scope="module")
def scan(folder):
    """A grey picture of an irregular grating, 48 x 48 pixels, that does not wrap."""
    x, y = np.meshgrid(*[np.arange(48) / 48] * 2)
    grey = 127 + 90 * np.sin(2 * np.pi * 5.3 * x + np.sin(2 * np.pi * y)) + 30 * np.cos(2 * np.pi * 2.6 * y)
    Image.fromarray(grey.astype(np.uint8)).save(folder / "skin.png")
    return folder / "skin.png"
