# SPDX-License-Identifier: GPL-3.0-or-later
"""The verb `map`: pictures of height maps and of bakes, and its progress."""

import json

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from precompute.maps.brdf_map import linear_rgb
from precompute.table import atlas
from precompute.table.table import Table

from .conftest import PICTURE, SHORT


def test_progress_as_text(run, scan, tmp_path):
    _, _, err = run("map", scan, *PICTURE, *SHORT, "-o", tmp_path / "map.png", "--size", "16")
    assert err.splitlines()[-1] == "wavelengths: 100%"


@pytest.mark.night("test_maps_by_either_method_agree")
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
    atlas.write_together({tmp_path / "up.exr": atlas.pack(table)}, {})
    for name in ("map.png", "map_linear.exr"):
        assert run("map", tmp_path / "up.exr", "-o", tmp_path / name, "--size", "32")[0] == 0
    linear = OpenEXR.File(str(tmp_path / "map_linear.exr")).channels()["RGB"].pixels
    assert linear[:12].max() > 0 and linear[17:].max() == 0
    shown = np.asarray(Image.open(tmp_path / "map.png"))
    assert shown[8, 16].min() > 50 and shown[24, 16].max() == 0


@pytest.mark.night("test_maps_by_either_method_agree")
def test_map_under_a_lamp(run, refused, scan, small_bake, tmp_path):
    """Of a bake with channels for lamps, as sums under the lamp's spectrum show it: within the bake's dE00 of 1, which
    is 2.5 code values, as in test_maps_by_either_method_agree. Daylight's picture differs more."""
    given = ("--delta-e", "1", *SHORT, "--no-cache", "--progress", "none")
    assert run("bake", scan, *PICTURE, *given, "--spectra", "smooth", "-o", tmp_path / "smooth")[0] == 0
    shown = {}
    for name, source in (
        ("bake", (tmp_path / "smooth", "--lamp", "tungsten")),
        ("sums", (scan, *PICTURE, *SHORT, "--method", "reference", "--step-nm", "10", "--lamp", "2700K")),
        ("own", (scan, *PICTURE, *SHORT, "--lamp", "2700K")),
        ("daylight", (tmp_path / "smooth",)),
    ):
        path = tmp_path / f"{name}.png"
        assert run("map", *source, "-o", path, "--size", "48", "--theta-i", "-20")[0] == 0
        shown[name] = np.asarray(Image.open(path)).astype(int)
    off = {name: np.abs(shown[name] - shown["sums"]).mean() for name in ("bake", "own", "daylight")}
    print(off)
    assert max(off["bake"], off["own"]) < 2 < off["daylight"]
    told = refused("map", small_bake, "--lamp", "2700K", "-o", tmp_path / "map.png")
    assert "a bake for D65 alone has no colours under 2700K; bake with --illuminant smooth" in told


REFERENCE = ("--method", "reference", "--size", "16", "--progress", "none")


def test_an_exr_of_xyz_is_the_one_of_rec_709(run, scan, tmp_path):
    """To the rounding of single precision, times 3.2, the largest sum of a row of the matrix."""
    found = {}
    for channels in ("xyz", "rgb"):
        path = tmp_path / f"{channels}.exr"
        line = ("map", scan, *PICTURE, *SHORT, *REFERENCE, "--step-nm", "40", "--channels", channels, "-o", path)
        assert run(*line)[0] == 0
        pixels = OpenEXR.File(str(path), separate_channels=True).channels()
        assert set(pixels) == set(channels.upper())
        found[channels] = np.stack([pixels[name].pixels for name in channels.upper()], axis=-1)
    expected = linear_rgb(found["xyz"])
    np.testing.assert_allclose(found["rgb"], expected, rtol=0, atol=3.2 * 2**-23 * found["xyz"].max())


def test_an_exr_of_a_spectrum_has_a_channel_for_each_wavelength(run, scan, tmp_path):
    path = tmp_path / "spectrum.exr"
    line = ("map", scan, *PICTURE, *SHORT, *REFERENCE, "--channels", "spectrum", "-o", path)
    assert run(*line, "--wavelength-nm", "550.5", "--wavelength-nm", "450")[0] == 0
    file = OpenEXR.File(str(path), separate_channels=True)
    assert file.header()["spectralLayoutVersion"] == "1.0"
    assert set(file.channels()) == {"T.450nm", "T.550,5nm"}
    # 800 nm along T: light along the normal has its first orders at lambda / 800 nm.
    middle = {name: channel.pixels[8] for name, channel in file.channels().items()}
    x = (np.arange(16) + 0.5) / 8 - 1
    for name, sine in (("T.450nm", 0.5625), ("T.550,5nm", 0.688)):
        outer = np.where(x > 0.3, middle[name], 0)
        assert abs(x[outer.argmax()] - sine) <= 1 / 8
    assert run(*line, "--step-nm", "100")[0] == 0
    names = set(OpenEXR.File(str(path), separate_channels=True).channels())
    assert names == {"T.380nm", "T.480nm", "T.580nm", "T.680nm", "T.780nm"}


def test_the_light_can_stand_at_any_azimuth(run, tmp_path):
    """The mirror image of a light that is turned by 90 degrees from -x, so at -y, is at +y: in the upper half."""
    path = tmp_path / "map.png"
    light = ("--theta-i", "40", "--phi-i", "90", *SHORT)  # a kernel as wide as a pixel
    assert run("map", "sample:flat", *REFERENCE, *light, "-o", path)[0] == 0
    pixels = np.asarray(Image.open(path)).astype(int).sum(axis=-1)
    x, y = np.meshgrid(np.arange(16) - 7.5, 7.5 - np.arange(16))
    row, col = np.unravel_index(np.where(np.hypot(x, y) < 7, pixels, 0).argmax(), (16, 16))
    # sin 40 deg = 0.64 of the radius of 8 pixels.
    assert y[row, col] == pytest.approx(8 * 0.64, abs=1) and abs(x[row, col]) <= 1


def test_a_window_elsewhere_sees_what_is_there(run, tmp_path):
    """The left half of 8 um is flat, the right half has 800 nm along T: at 500 nm its first orders are at +-0.625."""
    line = np.where(np.arange(96) < 48, 127, 127 + 120 * np.sin(2 * np.pi * np.arange(96) / 9.6))
    Image.fromarray(np.tile(line.astype(np.uint8), (48, 1))).save(tmp_path / "half.png")
    path, outer = tmp_path / "map.exr", {}
    for x in ("2", "6"):
        line = ("map", tmp_path / "half.png", "--size-um", "8", "--height-nm", "250", "--coherence-um", "3", "-o", path)
        shown = ("--method", "flss", "--size", "16", "--channels", "spectrum", "--wavelength-nm", "500")
        assert run(*line, *shown, "--patch-um", f"{x},2")[0] == 0
        row = OpenEXR.File(str(path), separate_channels=True).channels()["T.500nm"].pixels[8]
        outer[x] = row[12:14].max() / row.max()
    # The window's tail in the other half has a hundredth, as the scan's own window dims the left edge.
    assert outer["2"] < 0.02 and outer["6"] > 0.1


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        (("-o", "map.png", "--patch-um", "1,1"), "the method bake has no window on one patch; leave it out, or give"),
        (("-o", "map.png", "--patch-um", "1"), "1: give two numbers, as 20,32.5"),
        (("-o", "map.png", "--patch-um=-1,2"), "'-1': give a number from 0 to 1e+06"),
        (("-o", "map.png", "--channels", "xyz"), "a PNG cannot hold --channels xyz; name the file .exr"),
        (("-o", "map.png", "--lamp", "moon"), "moon: is not a known illuminant"),
        (("-o", "map.png", "--lamp", "smooth"), "smooth is not a single lamp; give one, such as 2700K"),
        (("-o", "map.png", "--lamp", "2700K", "--method", "stam"), "--lamp: the method stam has no lamp; leave it out"),
        (
            ("-o", "map.exr", "--lamp", "2700K", "--channels", "spectrum", "--method", "reference"),
            "a spectrum has no l",
        ),
        (("-o", "map.exr", "--wavelength-nm", "500"), "--channels rgb has no wavelengths"),
        (("-o", "map.exr", "--channels", "spectrum"), "a bake holds colours, no spectra; give the height map"),
        (("-o", "map.exr", "--channels", "spectrum", "--wavelength-nm", "300"), "give a number from 380 to 780"),
    ],
)
def test_maps_that_cannot_be_made_are_refused(run, tmp_path, monkeypatch, options, fault):
    monkeypatch.chdir(tmp_path)
    status, _, err = run("map", "sample:flat", *options)
    assert status != 0 and fault in err and len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
