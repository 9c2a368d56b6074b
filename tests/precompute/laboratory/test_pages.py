# SPDX-License-Identifier: GPL-3.0-or-later
"""Pages that programs fill with figures: every place is filled, none is unknown, and programs hold no prose."""

import argparse
import ast
import json
import re
from pathlib import Path

import pytest

from laboratory.benchmarks import evaluation_maps, evaluation_page, picture
from laboratory.speed.result import Machine
from laboratory.study import pages, terms
from precompute.bake.cache import BAKE_VERSION

ROOT = Path(__file__).resolve().parents[3]
DOCS = ROOT / "docs"
FILLED = {
    "evaluation.md",
    "speed.md",
}
WRITERS = [path for path in (ROOT / "laboratory").rglob("*.py") if "study.pages import" in path.read_text()]
# Words in one string of a program that writes a page; the longest are heads of tables and names of cases.
WORDS_MAX = 20


def places(text):
    """The names of the marks of a page that open a place, and of those that close one, in order."""
    return re.findall(r"<!-- ([^/][^>]*) -->", text), re.findall(r"<!-- /([^>]*) -->", text)


def test_a_table_is_markdown():
    assert pages.table(["a", "b"], [["1", "2"]]) == "| a | b |\n| --- | --- |\n| 1 | 2 |"


def test_a_page_is_filled_with_figures(monkeypatch, tmp_path):
    (tmp_path / "docs").mkdir()
    page = "Of <!-- n -->1<!-- /n -->:\n\n<!-- a table -->\n| a |\n<!-- /a table -->\n\nEnd {}.\n"
    (tmp_path / "docs" / "page.md").write_text(page)
    monkeypatch.setattr(pages, "ROOT", tmp_path)
    found = pages.filled("page.md", {"n": "{2}", "a table": "| b |\n| c |\n"})
    assert found == "Of <!-- n -->{2}<!-- /n -->:\n\n<!-- a table -->\n| b |\n| c |\n<!-- /a table -->\n\nEnd {}.\n"
    for figures in ({}, {"n": "2"}, {"n": "2", "a table": "", "more": ""}):
        with pytest.raises(ValueError, match="page.md: its places are"):
            pages.filled("page.md", figures)


def test_a_page_is_written_with_the_record_of_its_figures(tmp_path):
    text = "<!-- one a -->1<!-- /one a -->\n<!-- two b -->2<!-- /two b -->\n"
    pages.write_page(tmp_path, "page.md", text, part="two ")
    assert (tmp_path / "page.md").read_text() == text
    record = json.loads((tmp_path / "figures.json").read_text())
    assert record.pop("page.md") == {"two b": {"bake_version": BAKE_VERSION, "figure": "2"}}
    assert record == json.loads((DOCS / "figures.json").read_text())


@pytest.mark.parametrize("page", sorted(FILLED))
def test_a_page_filled_with_its_own_figures_stays_as_it_is(page):
    text = (DOCS / page).read_text()
    opened, closed = places(text)
    assert opened == closed and len(set(opened)) == len(opened)
    figures = {name: re.search(f"<!-- {re.escape(name)} -->(.*?)<!-- /", text, re.DOTALL)[1] for name in opened}
    assert pages.filled(page, figures) == text


def test_only_these_pages_have_places():
    assert {page.name for page in DOCS.glob("*.md") if any(places(page.read_text()))} - {"developing.md"} == FILLED


def test_the_evaluation_has_a_place_for_every_figure():
    tables = {"blaze": [], "elaphe": [], "xenopeltis": []}
    facts = evaluation_page.Facts(False, tables, {}, 0.4, {"elaphe": [1.0], "xenopeltis": [1.0]}, terms.table()[:1], [])
    page = evaluation_page.text(facts, evaluation_maps.groups())
    assert "<!-- grid -->0.400<!-- /grid --> square" in " ".join(page.split())
    assert "1 to 1 nm (mean 1.0, standard deviation 0.0)<!-- /periods of elaphe -->" in page
    assert evaluation_page.STAND_INS in page and evaluation_page.NO_MAPS in page


def test_the_picture_has_a_place_for_every_figure():
    errors = {"mean": 2.0, "p95": 9.0, "flip": 0.05, "light": 1.0}
    row = {"method": "Direct dE 1", "samples": 4, "seconds": 1.5, **errors}
    other = row | {"method": "Direct dE 3"}
    tables = [{"scene": "cd", "engine": "eevee", "reference": {"seconds": 3.0, **errors}, "rows": [other, row]}]
    arguments = argparse.Namespace(scene=["cd"], engine=None, width=99, reference=77, most=5.0)
    machine = Machine("a processor", 3, "Linux", "3", "2", "0.1")
    page = picture.text(tables, arguments, on=machine, blender="9.9")
    assert "`./dev bench picture --scene cd --width 99 --reference 77 --most 5 --output docs`" in page
    assert "| a processor, 3 cores, no GPU |" in page and "| Blender | 9.9 |" in page
    assert "| A disc, EEVEE | half of the reference | - | 3.00 | 2.0 | 0.0500 |" in page
    assert "| A disc, EEVEE | Direct dE 1 | 4 | 1.50 | 2.0 | 0.0500 |" in page and "Direct dE 3" not in page
    assert "<!-- core setting -->" in page


@pytest.mark.parametrize("path", sorted(WRITERS), ids=lambda path: path.stem)
def test_no_program_holds_the_prose_of_a_page(path):
    tree = ast.parse(path.read_text())
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef)
    docstrings = {ast.get_docstring(node, clean=False) for node in ast.walk(tree) if isinstance(node, documented)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value not in docstrings:
            assert len(node.value.split()) <= WORDS_MAX, node.value
