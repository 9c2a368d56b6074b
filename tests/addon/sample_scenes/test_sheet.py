# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets of labelled pictures, and films."""

import numpy as np
import pytest
from PIL import Image

from sample_scenes.sheet import join, main

WIDTH, HEIGHT = 160, 90


def painted(grey: int, size=(WIDTH, HEIGHT)) -> Image.Image:
    return Image.new("RGB", size, (grey,) * 3)


def test_tiles_lie_in_rows_without_overlap_and_each_has_its_label():
    sheet = np.asarray(join([("One", painted(20)), ("", painted(60)), ("Three", painted(100, (80, 45)))], columns=2))
    low = slice(HEIGHT // 2, HEIGHT)  # labels stand in the upper half
    assert (sheet[low, :WIDTH] == 20).all()
    assert (sheet[low, -WIDTH:] == 60).all()
    assert (sheet[-HEIGHT // 2 :, :WIDTH] == 100).all()  # resized to the first
    upper = sheet[: HEIGHT // 2]
    assert (upper[:, :WIDTH] != 20).any()
    assert (upper[:, -WIDTH:] == 60).all()  # without a label


def test_frames_become_a_film(tmp_path):
    frames = []
    for k in range(3):
        frames.append(str(tmp_path / f"{k}.png"))
        painted(80 * k).save(frames[-1])
    film = tmp_path / "film.webp"
    assert main([*frames, "--output", str(film), "--width", "80"]) == 0
    with Image.open(film) as opened:
        assert (opened.n_frames, opened.size) == (3, (80, 45))


def test_a_missing_picture_is_named(tmp_path, capsys):
    assert main(["A=absent.png", "--output", str(tmp_path / "sheet.jpg")]) == 1
    assert "absent.png" in capsys.readouterr().err
    assert not (tmp_path / "sheet.jpg").exists()


@pytest.mark.parametrize("columns", [1, 3])
def test_a_sheet_has_the_size_of_its_rows(columns):
    sheet = join([("", painted(0))] * 3, columns)
    assert sheet.width >= columns * WIDTH
    assert sheet.height >= (3 // columns) * HEIGHT
