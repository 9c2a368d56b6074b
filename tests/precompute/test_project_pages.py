# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of the README's length, the links and commands of all pages, and the project's version."""

import argparse
import importlib
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path

import pytest

from devtools import cli
from laboratory.benchmarks.__main__ import main as bench
from laboratory.verbs import PACKAGES
from precompute.cli.parser import build_parser
from tests.printed_commands import PAGES, printed

from .test_layering import ROOT

# A link to a page, with or without an anchor, or to an anchor of the same page, but not into the web.
_LINK = re.compile(r"\]\((?!\w+:)([^)#\s]*)(?:#([^)\s]+))?\)")


def anchors(page: Path) -> set[str]:
    """The anchors of a page's titles, as GitHub makes them."""
    titles = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def broken(page: Path) -> list[str]:
    """The broken links of a page."""
    found = []
    for name, anchor in _LINK.findall(page.read_text(encoding="utf-8")):
        target = page.parent / name if name else page
        if not target.exists() or anchor and anchor not in anchors(target):
            found.append(f"{name}#{anchor}")
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    assert broken(page) == []


def test_a_broken_link_would_be_found(tmp_path):
    page = tmp_path / "a.md"
    page.write_text("# One & Two\n[a](a.md#one--two) [b](#gone) [c](gone.md) [d](https://example.org/x)")
    assert broken(page) == ["#gone", "gone.md#"]


def test_the_readme_is_short_and_names_the_two_commands():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.split()) <= 700
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
        elif name in ("build", "lint", "mutants", "release", "walk"):
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
