# SPDX-License-Identifier: GPL-3.0-or-later
"""The library: its wheel in an empty environment, the examples of its page and docstrings, and its command."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import precompute
from devtools import ROOT
from devtools.steps import clean_environment

# Runs the examples of docs/library.md, and then those of the names' docstrings, which read its bake.
EXAMPLES = """
import doctest, sys
from pathlib import Path
import numpy, natural_gratings
names = {name: getattr(natural_gratings, name) for name in natural_gratings.__all__}
failed = doctest.testfile(sys.argv[1], module_relative=False).failed
finder, runner = doctest.DocTestFinder(recurse=False), doctest.DocTestRunner()
for name, thing in names.items():
    (test,) = finder.find(thing, name, module=False, globs=names | {"np": numpy, "Path": Path})
    assert test.examples, f"{name} has no example"
    failed += runner.run(test).failed
sys.exit(failed > 0)
"""


@pytest.fixture(scope="module")
def environment(tmp_path_factory) -> Path:
    """An environment that holds only the library and what it needs, outside the checkout."""
    folder = tmp_path_factory.mktemp("library")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder / "venv"], check=True)
    pip = [sys.executable, "-m", "pip", "--python", folder / "venv" / "bin" / "python", "--no-input"]
    command = [*pip, "--disable-pip-version-check", "install", "--no-compile", ROOT]
    answer = subprocess.run(command, cwd=folder, env=clean_environment(), capture_output=True, text=True)
    if answer.returncode and "connection broken" in answer.stdout + answer.stderr:
        pytest.skip("no package index")
    assert answer.returncode == 0, answer.stderr
    return folder


def start(folder: Path, program: str, *words: str | Path) -> subprocess.CompletedProcess[str]:
    command = [folder / "venv" / "bin" / program, *words]
    return subprocess.run(command, cwd=folder, env=clean_environment(), capture_output=True, text=True)


def test_the_examples_are_right(environment):
    answer = start(environment, "python", "-c", EXAMPLES, ROOT / "docs" / "library.md")
    assert answer.returncode == 0, answer.stdout + answer.stderr


def test_the_command_runs(environment):
    told = json.loads(start(environment, "natural-gratings", "info", "sample:cd", "--json", "-").stdout)
    assert told["rows"] > 0
    refused = start(environment, "natural-gratings", "bake", "gone.gwy", "-o", "bakes")
    assert (refused.returncode, refused.stderr.count("\n")) == (1, 1)
    assert "natural-gratings [-h] VERB" in start(environment, "natural-gratings", "--help").stdout


def test_the_wheel_holds_the_tables_and_the_presets(environment):
    (package,) = environment.glob("venv/lib/python*/site-packages/natural_gratings")
    held = {path.relative_to(package) for path in package.rglob("*") if path.is_file() and path.suffix != ".pyc"}
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "precompute"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert held == {Path(name).relative_to("precompute") for name in listed.stdout.splitlines()}


def test_a_name_that_is_not_there_is_no_attribute():
    assert not hasattr(precompute, "gone")


def test_the_library_needs_what_the_extension_ships():
    """NumPy is Blender's own; xatlas is for one verb."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    needs = {each.partition(">=")[0] for each in project["project"]["dependencies"]}
    needs |= {each.partition(">=")[0] for each in project["project"]["optional-dependencies"]["unwrap"]}
    assert needs == {each.partition("==")[0] for each in project["dependency-groups"]["runtime"]} | {"numpy"}
