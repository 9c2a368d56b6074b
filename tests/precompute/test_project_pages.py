# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of the README's length and commands, the links of all pages, and the project's version."""

import re
import tomllib
from pathlib import Path

import pytest

from .test_layering import ROOT

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")])
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


def test_there_is_one_version():
    """The version is in the manifest. The changelog's newest release and the citation repeat it and share one date."""
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["version"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    released = re.search(r"^## \[(\d[^]]*)\] - (\S+)$", changes, re.MULTILINE)
    assert released.groups() == (version, re.search(r"^date-released: (\S+)$", citation, re.MULTILINE)[1])
    assert re.search(r"^version: (\S+)$", citation, re.MULTILINE)[1] == version
    assert "project" not in tomllib.loads((ROOT / "pyproject.toml").read_text())
