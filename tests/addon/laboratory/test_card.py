# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of a graphics card, with the processor in the card's place."""

import json

import numpy as np
import pytest

from laboratory.benchmarks import card
from laboratory.benchmarks.card import file_of
from laboratory.benchmarks.card_pictures import Job, picture_of


@pytest.fixture
def files(scene, tmp_path):
    """A folder with the file of one row."""
    import bpy

    folder = tmp_path / "files"
    path = file_of(folder, "cd", "grating", 1)
    path.parent.mkdir(parents=True)
    scene.collection.objects.link(bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera")))
    scene.camera = bpy.data.objects["Camera"]
    scene.camera.location.z = 3
    scene.world = None
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    return folder


ROW = ("--engine", "cycles", "--scene", "cd", "--material", "grating", "--lamps", "1", "--width", "16", "--height", "8")


@pytest.mark.night("test_a_process_that_fails_is_a_row")
def test_a_row_and_its_picture(files, tmp_path, capsys):
    pictures, figures = tmp_path / "pictures", tmp_path / "figures.json"
    command = [*ROW, "--samples", "1", "--samples", "3", "--files", str(files), "--output", str(pictures)]
    assert card.main([*command, "--json", str(figures)]) == 0
    (row,) = json.loads(figures.read_text())["rows"]
    assert (row["device"], row["scene"], row["material"], row["lamps"]) == ("CPU", "cd", "grating", 1)
    assert row["sample"] == pytest.approx((row["seconds"]["3"] - row["seconds"]["1"]) / 2)
    assert "grating       1" in capsys.readouterr().out.splitlines()[-2]
    picture = card.read(picture_of(pictures, file_of(files, "cd", "grating", 1), "CPU", 3))
    assert picture.shape == (8, 16, 3)
    # A sun of 1 W/m2 straight above the default material: 0.8 / pi, and since Blender 5 the middle of the highlight of
    # roughness 0.5, 0.04 / (4 pi 0.5^4). Three samples have no noise there.
    assert (0.24 < picture[4, 8]).all() and (picture[4, 8] < 0.31).all()


def test_a_process_that_fails_is_a_row(files, tmp_path, capsys):
    file_of(files, "cd", "grating", 1).write_bytes(b"no file of Blender's")
    assert card.main([*ROW, "--samples", "1", "--files", str(files), "--output", str(tmp_path / "pictures")]) == 1
    assert "failed: " in capsys.readouterr().out


def test_differences_are_over_the_mean():
    truth = np.full((100, 100, 3), 2.0)
    picture = truth.copy()
    picture[:2] += 1.0
    picture[2:80] += 0.02
    median, p99 = card.differences(picture, truth)
    assert (median, p99) == pytest.approx((0.01, 0.5))


def test_without_the_processor_s_picture_there_is_no_difference(tmp_path):
    job = Job("CUDA", [], (16, 8), samples=[1], output=str(tmp_path), repeat=1)
    file = file_of(tmp_path, "cd", "metal", 3)
    row = card._row({"file": str(file), "seconds": {"1": 0.5}}, job)
    assert "median" not in row and row["material"] == "metal" and row["lamps"] == 3
