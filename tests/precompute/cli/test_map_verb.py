# SPDX-License-Identifier: GPL-3.0-or-later
"""The verb `map`: pictures of height maps and of bakes, and its progress."""

import json

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from precompute.table import atlas, atlas_file
from precompute.table.table import Table

from .conftest import PICTURE, SHORT


def test_progress_as_text(run, scan, tmp_path):
    _, _, err = run("map", scan, *PICTURE, *SHORT, "-o", tmp_path / "map.png", "--size", "16")
    assert err.splitlines()[-1] == "wavelengths: 100%"


def test_map_of_a_mirror_is_colourless(run, tmp_path):
    """Grey to one code value of rounding, by the bake and by the exact spectrum. Half floats of XYZ are exact to 2^-12,
    and RGB to 3.2 times that. With the slope of sRGB, 1 / 2.4, this is a third of a code value."""
    for method in ("bake", "reference"):
        path = tmp_path / f"{method}.png"
        options = ("--size", "64", "--method", method, "--step-nm", "50", "--progress", "none")
        status, out, err = run("map", "sample:flat", "-o", path, *options)
        assert (status, out, err) == (0, f"{path}\n", "")
        shown = np.asarray(Image.open(path)).astype(int)
        assert shown.shape == (64, 64, 3)
        assert np.ptp(shown, axis=-1).max() <= 1
        assert shown[32, 32].min() >= 250
        assert shown[32, 10].max() <= 1


def test_map_of_a_grating_is_coloured_on_both_sides(run, scan, tmp_path):
    """800 nm along T: the first orders of green are at +-0.69, with blue inside and red outside."""
    path = tmp_path / "deep" / "map.png"
    assert run("map", scan, *PICTURE, *SHORT, "-o", path, "--size", "96", "--json", "-")[0] == 0
    shown = np.asarray(Image.open(path)).astype(int)
    middle = shown[40:56]
    at = {x: middle[:, round((x + 1) * 48)].mean(axis=0) for x in (-0.85, -0.57, 0.57, 0.85)}
    for side in (-1, 1):
        assert at[side * 0.57][2] > at[side * 0.57][0]
        assert at[side * 0.85][0] > at[side * 0.85][2]


def test_maps_by_either_method_agree(run, scan, tmp_path):
    """Compared in code values of pictures that are each exposed by their own percentile. The mean difference is below
    2. The colour error of 1 that a bake may have is about 2.5 code values."""
    shown = []
    for method in ("bake", "reference"):
        path = tmp_path / f"{method}.png"
        options = ("--size", "48", "--theta-i", "-20", "--method", method, "--step-nm", "10")
        assert run("map", scan, *PICTURE, *SHORT, "-o", path, *options)[0] == 0
        shown.append(np.asarray(Image.open(path)).astype(int))
    assert np.abs(shown[0] - shown[1]).mean() < 2


@pytest.mark.parametrize("which", ["file", "folder"])
def test_map_of_a_bake(run, small_bake, tmp_path, which):
    path = tmp_path / "map.exr"
    source = small_bake if which == "file" else small_bake.parent
    status, out, _ = run("map", source, "-o", path, "--size", "32", "--json", "-")
    assert status == 0
    assert json.loads(out) == {"files": [str(path)]}
    pixels = OpenEXR.File(str(path)).channels()["RGB"].pixels
    assert pixels.shape == (32, 32, 3) and pixels.dtype == np.float32
    assert np.isfinite(pixels).all() and pixels.max() > 0
    assert sorted(each.name for each in tmp_path.iterdir()) == ["bakes", "map.exr"]


def test_row_zero_of_an_exr_map_is_plus_y(run, tmp_path):
    tiles = np.zeros((1, 256, 256, 3), np.float32)
    tiles[:, 140:] = 1
    table = Table(tiles, np.zeros((256, 3)), 0.05, 4 / 252, "D65")
    atlas_file.write_together({tmp_path / "up.exr": atlas.pack(table)}, {})
    for name in ("map.png", "map_linear.exr"):
        assert run("map", tmp_path / "up.exr", "-o", tmp_path / name, "--size", "32")[0] == 0
    linear = OpenEXR.File(str(tmp_path / "map_linear.exr")).channels()["RGB"].pixels
    assert linear[:12].max() > 0 and linear[17:].max() == 0
    shown = np.asarray(Image.open(tmp_path / "map.png"))
    assert shown[8, 16].min() > 50 and shown[24, 16].max() == 0
