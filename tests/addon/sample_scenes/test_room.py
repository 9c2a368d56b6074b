# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample room: lit by its windows, panels and lamp, and written as an environment picture."""

import subprocess
import sys

import numpy as np
import OpenEXR
import pytest

from devtools import ROOT
from precompute.world_sources.sources import panorama_cells
from sample_scenes.room import BLOCKS, HIGH, PANELS, room

ROWS = 32


@pytest.fixture(scope="module")
def picture():
    return room(ROWS)


def towards(picture, place) -> np.ndarray:
    """The radiance (3,) of the pixel that shows a place."""
    directions = panorama_cells(ROWS, 2 * ROWS).directions
    return picture.reshape(-1, 3)[np.argmax(directions @ (np.array(place) / np.linalg.norm(place)))]


def test_it_shines_where_panels_and_lamp_are(picture):
    assert picture.shape == (ROWS, 2 * ROWS, 3) and np.isfinite(picture).all() and picture.min() > 0
    wall = towards(picture, (HIGH[0], -0.1, -0.9))
    for panel in PANELS:
        middle = np.empty(3)
        middle[panel.axis] = HIGH[panel.axis]
        middle[[axis for axis in range(3) if axis != panel.axis]] = np.add(panel.low, panel.high) * (0.5, 0.25)
        middle = middle + (0, 0.1 * panel.bars, 0)  # beside the bars
        assert towards(picture, middle).min() > 5 * wall.max()
    shade = next(block for block in BLOCKS if any(block.radiance))
    red, _, blue = towards(picture, np.add(shade.low, shade.high) / 2)
    assert red > 1.5 * blue > 0.5


def test_furniture_shades_the_floor(picture):
    assert towards(picture, (0.1, 1.9, -1.25)).sum() != towards(picture, (0.1, 1.8, -0.84)).sum()
    under, open_floor = towards(picture, (0.15, 2.6, -1.3)), towards(picture, (1.8, 2.4, -1.3))
    assert under.sum() < open_floor.sum()


def test_a_seed_is_a_floor():
    one, same, other = room(8, 1), room(8, 1), room(8, 2)
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - other).max() > 0
    np.testing.assert_array_equal(one[-1], other[-1])  # the ceiling has no planks


def test_the_command_writes_a_picture(tmp_path):
    path = tmp_path / "room.exr"
    command = [sys.executable, "-m", "sample_scenes.room", "--output", str(path), "--rows", "16"]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    with OpenEXR.File(str(path)) as file:
        pixels = file.channels()["RGB"].pixels
        assert file.header()["comments"] == "CC0"
    np.testing.assert_allclose(pixels[::-1], room(16), rtol=1e-6)


def test_a_folder_that_is_not_there_is_told_in_a_line(tmp_path):
    command = [
        sys.executable,
        "-m",
        "sample_scenes.room",
        "--output",
        str(tmp_path / "no" / "room.exr"),
        "--rows",
        "16",
    ]
    done = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True)
    assert done.returncode != 0
    assert done.stderr.count("\n") == 1 and "no" in done.stderr
