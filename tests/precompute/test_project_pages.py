# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of the README's length, the text and commands of all pages, and the project's version. test_pages.py shows each
check of the text failing."""

import argparse
import importlib
import re
import tomllib
from collections.abc import Sequence

import pytest

from devtools import cli
from devtools.docs.pages import faults_of_pages
from laboratory.benchmarks.__main__ import main as bench
from laboratory.verbs import PACKAGES
from precompute.cli.parser import build_parser
from tests.printed_commands import PAGES, printed

from .test_layering import ROOT


def test_pages_have_no_faults():
    assert faults_of_pages() == []


def test_the_readme_is_short_and_names_the_two_commands():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.split()) <= 500
    assert "./dev demo --output demo" in text
    assert "./dev test" in text


class Parsed(Exception):
    """A program has read its command line, and would now begin."""


def start(words: Sequence[str]) -> None:
    """Start the program of a printed command. Raises Parsed, or SystemExit if it refuses. Blender's commands, and those
    that have no arguments of ours, are not started."""
    if words[0] == "./dev":
        name, *arguments = words[3:] if words[1].startswith("--") else words[1:]
        if name == "grating" and arguments[1:]:
            build_parser(arguments, PACKAGES).parse_args(arguments)
        elif name == "bench" and arguments:
            bench(arguments)
        elif name in ("demo", "scenes"):
            importlib.import_module(f"sample_scenes.{name}").main(["--output", "DIR", *arguments])
        elif name in ("build", "docs", "lint", "mutants", "release", "walk"):
            cli.VERBS[name](argparse.Namespace(), arguments)
        assert name in cli.VERBS
    elif words[:2] == ["python", "-m"] and words[3:] and words[2] != "pytest":
        importlib.import_module(words[2]).main(words[3:])
    raise Parsed


def test_the_programs_understand_the_commands_that_pages_print(monkeypatch, tmp_path):
    """Blender's are in tests/addon/batch/test_commands.py. tests/package/test_printed_commands.py runs both."""
    parse = argparse.ArgumentParser.parse_args

    def stop(self, args=None, namespace=None):
        parse(self, args, namespace)
        raise Parsed

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", stop)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lamp.csv").write_text("400, 1\n700, 1\n")  # --illuminant reads it at once
    for page in PAGES:
        for words in printed(page):
            with pytest.raises(Parsed):
                start(words)


def test_there_is_one_version():
    """The version is in the manifest. The library, the changelog's newest release and the citation repeat it; release
    and citation share one date."""
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["version"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    released = re.search(r"^## \[(\d[^]]*)\] - (\S+)$", changes, re.MULTILINE)
    assert released.groups() == (version, re.search(r"^date-released: (\S+)$", citation, re.MULTILINE)[1])
    assert re.search(r"^version: (\S+)$", citation, re.MULTILINE)[1] == version
    assert tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"] == version
