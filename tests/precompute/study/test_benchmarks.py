# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmarks' runner, and the pieces of the evaluation's page that can be checked without its minutes."""

import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks import __main__ as runner
from benchmarks import evaluation as benchmark
from benchmarks import evaluation_page

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


@pytest.mark.parametrize("page", ["evaluation.md", "hard_cases.md", "osl.md", "theory.md", "speed_against_error.md"])
def test_what_the_pages_name_is_there(page):
    text = (DOCS / page).read_text()
    for picture in re.findall(r"\]\((images/[^)]+)\)", text):
        assert (DOCS / picture).is_file(), picture
    for module in re.findall(r"(?:precompute|benchmarks|tests)/[\w/]+\.py", text):
        assert (DOCS.parent / module).is_file(), module


def test_the_committed_pictures_are_small():
    pictures = list((DOCS / "images" / "evaluation").glob("*.png"))
    assert pictures
    assert sum(picture.stat().st_size for picture in pictures) < 3e6
