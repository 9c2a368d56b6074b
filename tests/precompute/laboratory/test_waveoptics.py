# SPDX-License-Identifier: GPL-3.0-or-later
"""The comparison with WaveOpticsBrdf, on folders that our own sums fill in its place."""

import numpy as np
import pytest

from laboratory.benchmarks import waveoptics
from laboratory.benchmarks.waveoptics import Views, bakes, compared, cut_density, sheet, tables
from laboratory.benchmarks.waveoptics_folder import HEIGHTS, Question, commands, prepare, relief_in, write
from precompute.base.failure import GratingError
from precompute.maps.brdf_map import light_from, view_hemisphere
from precompute.reference.reference import PatchReference
from precompute.spectra.spectrum import window_at
from precompute.surface.height_map import HeightMap

QUESTION = Question(texels=128, texel_um=0.05, sigma_um=0.8, wavelengths_nm=(550,), lights_deg=(0, 30))
SIZE = 24
# Half floats round by at most 2^-11, about.
ROUNDED = 2**-11


@pytest.fixture
def folder(tmp_path):
    """A folder with the answers of our sums at the normal, and at 30 degrees of 0.98 times our sums, cut."""
    y, x = np.mgrid[:140, :140] * 0.05
    height = 60e-9 * np.cos(2 * np.pi * x / 0.9) + 40e-9 * np.sin(2 * np.pi * (x + 3 * y) / 2.2)
    prepare(tmp_path, QUESTION, HeightMap(height, (5e-8, 5e-8), "waves"))
    window = window_at(relief_in(tmp_path, QUESTION), 0.8e-6, (QUESTION.centre_um,) * 2)
    for deg in QUESTION.lights_deg:
        views = Views(light_from(np.radians(deg)), *view_hemisphere(SIZE))
        u, v, w = views.uvw
        if deg:
            density = 0.98 * cut_density(window, u, v, w, 550e-9)
        else:
            density = PatchReference(window).density(u, v, w, wavelength_m=550e-9)
        write(tmp_path / f"550nm_{deg}deg.exr", views.brdf(density).T)
    (tmp_path / "550nm_30deg.seconds").write_text("12.5\n")
    return tmp_path


def test_the_figures_of_known_answers(folder):
    baked = bakes(folder, QUESTION)[550]
    (same, theirs, ours), (cut, *_) = (compared(folder, QUESTION, 550, deg=deg, bake=baked) for deg in (0, 30))
    assert same.theirs <= ROUNDED and same.energy == pytest.approx(1, abs=ROUNDED)
    assert same.seconds[0] is None
    assert cut.beyond_cut == pytest.approx(0.02, abs=ROUNDED)
    assert cut.at_equal_light <= ROUNDED
    # exp(-9) of the window's light is beyond the cut.
    assert cut.energy == pytest.approx(0.98, abs=0.001)
    assert 0.002 < cut.cut < 0.1 and cut.cut - 0.02 <= cut.theirs <= cut.cut + 0.021
    assert cut.seconds[0] == 12.5
    # The bake keeps a dE00 of 2, less than 6 % of the light.
    assert max(same.baked, cut.baked) < 0.06
    figures, seconds = tables([same, cut])
    assert "| 550 nm | 30 degrees |" in figures and "| 550 nm | 0 degrees | - |" in seconds
    pixels = np.asarray(sheet([(theirs, ours)] * 2))
    side = len(pixels) // 2
    assert pixels.shape == (2 * side, 3 * side, 3)
    assert np.abs(pixels[:, :side].astype(int) - pixels[:, side : 2 * side]).max() <= 1
    assert pixels[:, 2 * side :].max() < 40 < pixels[:, :side].max()


def test_heights_lie_as_waveoptics_reads_them(tmp_path):
    """A bump to the right of the middle and above it is in a later row, and in a later column."""
    height = np.zeros((128, 128))
    height[20, 100] = 1e-7
    prepare(tmp_path, QUESTION, HeightMap(height, (5e-8, 5e-8), "bump"))
    relief = relief_in(tmp_path, QUESTION)
    assert np.unravel_index(relief.height_m.argmax(), (128, 128)) == (107, 100)
    assert np.ptp(relief.height_m) == pytest.approx(1e-7, rel=2 * ROUNDED)


def test_the_recipe_names_every_file(tmp_path):
    lines = commands(tmp_path, QUESTION)
    assert len(lines) == 3
    assert f"-o {tmp_path}/550nm_30deg.exr -w 0.0500000 -x 3.225000 -y 3.225000 -p 0.8 -l 0.55 -s -0.577350" in lines[2]


def test_a_missing_picture_is_one_line(folder, capsys):
    (folder / "550nm_0deg.exr").write_bytes(b"none")
    with pytest.raises(GratingError, match="0deg.exr: not a picture with a red channel; run the lines"):
        compared(folder, QUESTION, 550, deg=0, bake=None)
    with pytest.raises(SystemExit):
        waveoptics.main([str(folder)])
    assert capsys.readouterr().err.startswith(f"error: {folder}/400nm_0deg.exr: is missing; run the lines")
    (folder / HEIGHTS).unlink()
    with pytest.raises(GratingError, match="is missing"):
        relief_in(folder, QUESTION)


def test_without_a_folder_it_says_how_to_make_one(capsys):
    waveoptics.main([])
    out = capsys.readouterr().out
    assert out.startswith("skipped: needs a FOLDER") and "--prepare" in out and len(out.splitlines()) == 1
