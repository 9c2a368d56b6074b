# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmarks' runner, and the pieces of the evaluation's page that can be checked without its minutes."""

import argparse
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import __main__ as runner
from benchmarks import bake, evaluation_page, report
from benchmarks import evaluation as benchmark

DOCS = Path(__file__).resolve().parents[3] / "docs"


def test_every_benchmark_is_found(capsys):
    assert {"terms", "evaluation", "hard_cases"} <= set(runner.found())
    assert "evaluation_page" not in runner.found()
    assert runner.main(["--help"]) == 0
    assert "terms" in capsys.readouterr().out
    assert runner.main(["nothing"]) == 2
    assert "no such benchmark" in capsys.readouterr().err


def test_maps_have_their_own_names():
    maps = [one for group in benchmark.groups().values() for one in group]
    assert len({one.name for one in maps}) == len(maps)
    surfaces = benchmark.height_maps(Path("nowhere"))
    assert {one.surface for one in maps} <= set(surfaces)
    assert surfaces["elaphe"].source == "sample:elaphe"


def test_a_picture_s_steps_are_small():
    picture = np.arange(256, dtype=np.uint8).reshape(16, 16)
    assert np.abs(benchmark.coarser(picture).astype(int) - picture).max() <= 3
    assert benchmark.coarser(np.full((1, 1), 255, np.uint8))[0, 0] == 255


def test_a_table_is_markdown():
    assert evaluation_page.table([["a", "b"], ["1", "2"]]) == "| a | b |\n| --- | --- |\n| 1 | 2 |"


@pytest.mark.parametrize("page", sorted(path.name for path in DOCS.glob("*.md")))
def test_what_the_pages_name_is_there(page):
    text = (DOCS / page).read_text()
    for picture in re.findall(r"\]\((images/[^)]+)\)", text):
        assert (DOCS / picture).is_file(), picture
    for module in re.findall(r"(?:precompute|benchmarks|tests)/[\w/]+\.py", text):
        # developing.md spells a file that its reader will write NAME.py.
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


def test_a_bake_is_held_against_its_transforms(monkeypatch, capsys):
    seconds = iter([2.0, 4.0, 6.0])
    named = []

    def bake_in_child(scan, folder):
        named.append(scan)
        return {"seconds": next(seconds), "check_seconds": 1.0}

    monkeypatch.setattr(bake, "bake_in_child", bake_in_child)
    monkeypatch.setattr(bake, "transform_seconds", lambda shape: 0.25)
    runner.main(["bake", "sample:flat", "--runs", "1", "--json", "-"])
    facts = json.loads(capsys.readouterr().out)
    assert named == 3 * [["sample:flat"]]
    assert facts["surface"] == "sample:flat"
    assert (facts["alone"]["median_to_transforms"], facts["beside"]["best_to_transforms"]) == (2 / 6, 4 / 6)
    assert facts["beside_to_alone"] == 2.5


def test_a_bake_has_one_thread_unless_asked_otherwise():
    look = "import os, runpy; runpy.run_module('precompute'); print(os.environ['OPENBLAS_NUM_THREADS'])"
    for asked, expected in (({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3")):
        environment = {key: value for key, value in os.environ.items() if key != "OPENBLAS_NUM_THREADS"} | asked
        done = subprocess.run(
            [sys.executable, "-c", look], env=environment, cwd=DOCS.parent, capture_output=True, text=True, check=True
        )
        assert done.stdout.strip() == expected
