# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmarks' runner, and the quick parts of the evaluation's page."""

import argparse
import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from laboratory.benchmarks import __main__ as runner
from laboratory.benchmarks import (
    evaluation,
    evaluation_maps,
    report,
)
from laboratory.speed.surfaces import SKINS
from laboratory.study.evaluation import evaluate_method, thesis_settings, turned
from laboratory.study.response import FirstOrder
from precompute.colour.observer import wavelengths
from precompute.maps import brdf_map
from precompute.methods.method import Settings
from precompute.methods.method_registry import METHODS
from precompute.surface.height_map import HeightMap

DOCS = Path(__file__).resolve().parents[3] / "docs"


def test_no_benchmark_starts_blender_before_its_user_folder_is_chosen():
    """Every run imports all benchmarks, and Blender reads BLENDER_USER_RESOURCES when bpy is imported."""
    asked = "import sys; from laboratory.benchmarks.__main__ import found; found(); sys.exit('bpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", asked], cwd=DOCS.parent).returncode == 0


def test_every_benchmark_is_found(capsys):
    assert {"bake", "evaluation", "hard_cases"} <= set(runner.found())
    assert "evaluation_page" not in runner.found()
    assert runner.main(["--help"]) == 0
    assert "hard_cases" in capsys.readouterr().out
    assert runner.main(["nothing"]) == 2
    assert "no such benchmark" in capsys.readouterr().err


def test_maps_have_their_own_names():
    maps = [one for group in evaluation_maps.groups().values() for one in group]
    assert len({one.name for one in maps}) == len(maps)
    surfaces = evaluation_maps.height_maps(Path("nowhere"))
    cuts = {f"{name}, cut" for name in SKINS}
    assert {one.surface for one in maps} <= set(surfaces) | cuts
    assert {one.method for one in maps} <= set(evaluation.MAP_METHODS)
    assert surfaces["elaphe"].source == "sample:elaphe"
    assert surfaces["xenopeltis"].source == "sample:xenopeltis"


def test_the_thesis_s_cut_is_raw():
    height = np.random.default_rng(2).random((7, 9)) * 1e-7
    relief = evaluation_maps.as_the_thesis_cuts(HeightMap(height, (50e-9, 50e-9), "test"))
    assert not relief.periodic
    assert (relief.apodisation == 1).all()
    # Row 0 of the relief is the bottom of the scan; the corner moves to the middle, and the mean is zero.
    assert relief.height_m[3, 4] == pytest.approx(height[-1, 0] - height.mean(), abs=1e-20)
    assert relief.height_m.mean() == pytest.approx(0, abs=1e-20)


def test_taylor_about_the_mean_converges_to_the_phasor():
    height = np.random.default_rng(3).random((24, 24)) * 3e-7
    relief = evaluation_maps.as_the_thesis_cuts(HeightMap(height, (50e-9, 50e-9), "test"))
    u, v, w = np.linspace(-0.5, 0.5, 7), np.zeros(7), np.full(7, 1.9)
    settings = Settings(coherence_length_m=1e-6, terms=30, dtype=np.float64)
    taylor = evaluation_maps.flss_about_mean(relief, settings)
    chebyshev = METHODS["chebyshev"](relief, replace(settings, terms=None, tolerance=1e-9))
    found, expected = (method.density(u, v, w, wavelength_m=500e-9) for method in (taylor, chebyshev))
    # z = 2 pi 1.9 / 500 nm * 150 nm = 3.6, and 3.6^30 / 30! = 2e-16: only Chebyshev's tolerance is left.
    assert found == pytest.approx(expected, rel=1e-6)


def test_agreement_is_that_of_ranks():
    ours = np.random.default_rng(4).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    darker = (ours.astype(float) ** 2 / 600).astype(float)
    assert evaluation_maps.agreement(ours, darker) == pytest.approx([1, 1, 1])
    assert evaluation_maps.agreement(ours, 255.0 - ours) == pytest.approx([-1, -1, -1])
    # For some 1450 independent pixels the correlation is 0 +- 0.026; the test allows five times that.
    assert np.abs(evaluation_maps.agreement(ours, ours[::-1, ::-1])).max() < 0.13
    right = ours.copy()
    right[:, 32:] = 0
    assert evaluation_maps.agreement(right, ours) == pytest.approx([1, 1, 1])
    assert evaluation_maps.ranks(np.array([5, 1, 5, 9])).tolist() == [2.5, 1, 2.5, 4]


@pytest.mark.night("tests/precompute/laboratory/test_evaluation.py")
def test_the_thesis_s_cut_gives_its_period_of_elaphe(shared_data):
    """The thesis has 1144.262 nm with a variance of 0.401 from 81 wavelengths; here there are nine. Half a nanometre is
    less than the standard deviation, and the next stripe is 30 nm away."""
    surface = evaluation_maps.height_maps(shared_data)["elaphe"]
    relief = evaluation_maps.as_the_thesis_cuts(turned(surface, 0))
    period_m = evaluation.THESIS_PERIODS_M["elaphe"]
    first_order = FirstOrder(evaluation.THETA_I, period_m, wavelengths(50e-9), np.radians(0.04))
    found = evaluate_method("chebyshev", relief, thesis_settings(), first_order=first_order)
    assert found.as_dict()["period_mean_nm"] == pytest.approx(1144.262, abs=0.5)


@pytest.mark.night("test_agreement_is_that_of_ranks")
def test_the_map_of_xenopeltis_is_the_thesis_s(shared_data):
    """At 64 pixels and ten wavelengths. A half turn of the map keeps its orders but moves its speckle and swaps its two
    unlike fans. If the map did not match the thesis's, both agreements would be equal."""
    surface = evaluation_maps.height_maps(shared_data)["xenopeltis"]
    relief = evaluation_maps.as_the_thesis_cuts(surface)
    method = METHODS["chebyshev"](relief, Settings(step_m=40e-9))
    ours = brdf_map.picture(brdf_map.from_method(method, 64, brdf_map.light_from(0)))
    path = shared_data / "thesis_figures" / "brdfmap__flss_gratings__xeno.png"
    theirs = np.asarray(evaluation_maps.disc(path, 64))
    upright = evaluation_maps.agreement(ours, theirs)
    turned_round = evaluation_maps.agreement(ours[::-1, ::-1], theirs)
    assert min(np.subtract(upright, turned_round)) > 0.1


def test_a_picture_s_steps_are_small():
    picture = np.arange(256, dtype=np.uint8).reshape(16, 16)
    assert np.abs(evaluation.coarser(picture).astype(int) - picture).max() <= 3
    assert evaluation.coarser(np.full((1, 1), 255, np.uint8))[0, 0] == 255


@pytest.mark.parametrize("page", sorted(path.name for path in DOCS.glob("*.md")))
def test_what_the_pages_name_is_there(page):
    text = (DOCS / page).read_text()
    for picture in re.findall(r"\]\((images/[^)]+)\)", text):
        assert (DOCS / picture).is_file(), picture
    for module in re.findall(r"(?:precompute|laboratory|tests)/[\w/]+\.py", text):
        # developing.md writes NAME.py for a file that its reader creates.
        assert "NAME" in module or (DOCS.parent / module).is_file(), module


def test_the_committed_pictures_are_small():
    pictures = list((DOCS / "images" / "evaluation").glob("*.png"))
    assert pictures
    assert sum(picture.stat().st_size for picture in pictures) < 3e6


def test_figures_go_to_programs_and_people(tmp_path, capsys):
    for target in ("-", str(tmp_path / "figures.json")):
        parser = argparse.ArgumentParser()
        report.add_json(parser)
        target = parser.parse_args(["--json", target]).json
        report.say("for people", target)
        report.write({"n": 1}, target)
        captured = capsys.readouterr()
        if target == "-":
            assert json.loads(captured.out) == {"n": 1}
            assert captured.err == "for people\n"
        else:
            assert json.loads(Path(target).read_text()) == {"n": 1}
            assert captured.out.startswith("for people\n")


def test_a_bake_has_one_thread_whatever_is_asked():
    look = "import os, runpy; runpy.run_module('precompute'); print(os.environ['OPENBLAS_NUM_THREADS'])"
    for asked in ({}, {"OPENBLAS_NUM_THREADS": "3"}):
        environment = {key: value for key, value in os.environ.items() if key != "OPENBLAS_NUM_THREADS"} | asked
        done = subprocess.run(
            [sys.executable, "-c", look], env=environment, cwd=DOCS.parent, capture_output=True, text=True, check=True
        )
        assert done.stdout.strip() == "1"


@pytest.mark.night("test_a_bake_has_one_thread_whatever_is_asked")
def test_a_bake_of_two_threads_has_the_bytes_of_one(tmp_path):
    """The scan's self-check has long sums, which depend on the number of threads."""
    for threads in ("1", "2"):
        line = ["bake", "sample:elaphe", "--delta-e", "6", "--no-cache", "--progress", "none"]
        command = [sys.executable, "-m", "precompute", *line, "-o", str(tmp_path / threads)]
        environment = os.environ | {"OPENBLAS_NUM_THREADS": threads}
        subprocess.run(command, env=environment, cwd=DOCS.parent, capture_output=True, check=True)
    one, two = ({path.name: path.read_bytes() for path in (tmp_path / threads).iterdir()} for threads in ("1", "2"))
    assert one.keys() == {"elaphe.exr", "elaphe.lobes.exr"} and one == two
