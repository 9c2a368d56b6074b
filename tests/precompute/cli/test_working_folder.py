# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev` imports nothing from the folder in which it is called."""

import os
import subprocess
import sys

import pytest

from devtools import ROOT
from devtools.machine import answers
from devtools.steps import clean_environment
from tests.hostile_folder import set_traps


@pytest.mark.parametrize("line", [
    ("grating", "info", "sample:flat", "--json", "-"), ("grating", "--help"), ("bench", "--help"), ("demo", "--help"),
    ("scenes", "--help"), ("env",), ("lint", "--help"),
])  # fmt: skip
@pytest.mark.short("None-line0", "[-line5", ":-line0", ":-line3")
@pytest.mark.parametrize("python_path", [None, "", os.pathsep])
def test_nothing_of_the_working_folder_is_run(tmp_path, monkeypatch, line, python_path):
    """This holds too if PYTHONPATH has an empty element, which means the working folder. The user's own Python, which
    runs ./dev, would import from there, so it is started with -I."""
    mark = set_traps(tmp_path)
    monkeypatch.delenv("PYTHONPATH", raising=False)
    if python_path is not None:
        monkeypatch.setenv("PYTHONPATH", python_path)
    dev = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from devtools.cli import main; sys.exit(main())"
    done = subprocess.run([sys.executable, "-I", "-c", dev, *line], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert not mark.exists()


def test_other_pythons_are_asked_apart_from_the_working_folder(tmp_path, monkeypatch):
    mark = set_traps(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PYTHONPATH", raising=False)
    assert answers(sys.executable, "import json")
    assert not mark.exists()


def test_the_tools_of_the_set_up_run_apart_from_the_working_folder(tmp_path):
    mark = set_traps(tmp_path)
    command = [sys.executable, "-m", "pip", "--version"]
    done = subprocess.run(command, cwd=tmp_path, env=clean_environment(), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert not mark.exists()
