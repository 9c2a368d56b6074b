# SPDX-License-Identifier: GPL-3.0-or-later
"""The tests that docs/faults.md names are there."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from .test_layering import ROOT

# A file, a test of a file, or another test of the file before: `test_a.py`, `test_a.py::test_b`, `::test_c`.
_TEST = re.compile(r"`([\w./]*\.py)?(?:::(\w+))?`")


def named_in(page: str) -> Iterator[tuple[Path, str]]:
    """Each file that a page names, and the test in it, or nothing. Names are relative to the folder of their section's
    title, or begin at the root."""
    folder, file = ROOT, ROOT
    for line in page.splitlines():
        if line.startswith("## "):
            titled = re.search(r"\((tests/[\w/]+)\)", line)
            folder = ROOT / titled[1] if titled else ROOT
        cell = line.split("|")[-2] if line.startswith("|") else line  # of a table the last column has the tests
        for name, test in _TEST.findall(cell):
            if name:
                file = (ROOT if name.startswith(("tests/", "laboratory/")) else folder) / name
            if name or test:
                yield file, test


def absent(page: str) -> list[str]:
    """What a page names and is not there."""
    found = []
    for file, test in named_in(page):
        if not file.is_file():
            found.append(str(file.relative_to(ROOT)))
        elif test and test not in _functions(file):
            found.append(f"{file.relative_to(ROOT)}::{test}")
    return found


def _functions(file: Path) -> set[str]:
    return {node.name for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.FunctionDef)}


def test_every_test_that_the_page_names_is_there():
    page = (ROOT / "docs" / "faults.md").read_text()
    assert len(list(named_in(page))) > 150
    assert absent(page) == []


def test_every_fault_has_a_test():
    rows = [line for line in (ROOT / "docs" / "faults.md").read_text().splitlines() if line.startswith("|")]
    assert [row for row in rows if row.rstrip(" |").endswith("| -")] == []


def test_a_name_that_is_gone_would_be_found():
    page = (
        "## Tests (tests/precompute)\n| `test_faults_page.py::test_gone`, `::test_every_fault_has_a_test`, `no.py` |\n"
    )
    assert absent(page) == ["tests/precompute/test_faults_page.py::test_gone", "tests/precompute/no.py"]
