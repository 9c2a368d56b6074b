# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of docs/library.md from the page's examples."""

import pytest
from PIL import Image

from laboratory.study.library_page import main


@pytest.mark.night("tests/package/test_library.py")
def test_the_picture_shows_what_the_examples_compute(tmp_path, matplotlib):
    main([str(tmp_path / "library.png")])
    with Image.open(tmp_path / "library.png") as picture:
        assert picture.convert("HSV").getextrema()[1][1] > 200  # the colours of a spectrum
