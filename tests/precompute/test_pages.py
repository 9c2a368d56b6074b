# SPDX-License-Identifier: GPL-3.0-or-later
"""Each check of the pages finds its fault, and passes what is right."""

import pytest

from devtools.docs import pages
from devtools.docs.site import loaded_from_outside

KNOWN = {"Light Rig", "Put on {name}", "All by Samples"}
LONG = " ".join(["word"] * 31)
CAPTION = "*A hill: `./dev scenes --scene hill`.*"


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        (f"A.\n\nShort. {LONG}. Short.", [(3, "a sentence of 31 words: word word word word word ...")]),
        (f"- one\n- two\n  {LONG}", [(2, "a sentence of 32 words: two word word word word ...")]),
        (f"{LONG[5:]}, `a b c`.", [(1, "a sentence of 31 words: word word word word word ...")]),
        (f"{LONG[5:]} [a](b.md).\n{LONG[5:]}", [(1, "a sentence of 31 words: word word word word word ...")]),
        (f"{LONG[5:]}. {LONG[5:]}! {LONG[5:]}.", []),
        (f"# {LONG}\n\n| {LONG} |\n\n    {LONG}\n\n```\n{LONG}\n```\n\n<!-- {LONG} -->\n", []),
    ],
)
def test_long_sentences(text, faults):
    assert pages.long_sentences(text) == faults


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("One.\nPress **Dark Rig**.", [(2, "the add-on has no label Dark Rig")]),
        ("Choose *All*.", [(1, "the add-on has no label All")]),
        ("Press *Object > Dark\nRig*.", [(1, "the add-on has no label Dark Rig")]),
        ("Press **[Light Rig](a.md)**, *Put on Cube* or *Object > Light Rig*.", []),
        ("**Units.** Metres, in *one word*, **The sources**, `*Code*` and `2*Pi*3`.", []),
    ],
)
def test_unknown_labels(text, faults):
    assert pages.unknown_labels(text, KNOWN) == faults


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        (f"One.\n\n![](a.png)\n\n{CAPTION}", [(3, "a picture without alt text")]),
        ("![A hill](a.png)\n\nText.", [(1, "a picture without a caption in italics below it")]),
        ("![A hill](a.png)\n\n*A hill.*", [(1, "a picture without the command that makes it in its caption")]),
        ("| ![A hill](a.png) |", [(1, "a picture without a caption in italics below it")]),
        (f"![A hill](a.png)\n\n{CAPTION}\n\n![A plan](a.svg)\n\n*A plan.*\n\n| ![A hill](a.png)<br>A hill |", []),
    ],
)
def test_bare_pictures(text, faults):
    assert pages.bare_pictures(text) == faults


def test_dead_links(tmp_path):
    page = tmp_path / "a.md"
    text = "# One & Two\n[a](a.md#one--two) [b](#gone)\n[c](gone.md) [d](https://example.org/x)"
    page.write_text(text)
    assert pages.dead_links(page, text) == [(2, "the link #gone is dead"), (3, "the link gone.md is dead")]


def test_figures_are_recorded_and_of_the_present_bakes():
    text = "Of <!-- a -->1<!-- /a -->\n<!-- b -->\n2\n<!-- /b -->\n<!-- c -->3<!-- /c -->\n"
    recorded = {"a": {"figure": "1", "bake_version": 5}, "b": {"figure": "2", "bake_version": 4}}
    assert pages.old_figures(text, recorded, 5) == [
        (2, "the figure b is of bakes of version 4, now 5; measure it again"),
        (5, "the figure c is not that of docs/figures.json"),
    ]


def test_over_budget(monkeypatch):
    monkeypatch.setattr(pages, "PAGES_MAX", 2)
    monkeypatch.setattr(pages, "WORDS_MAX", 4)
    assert pages.over_budget(["one two", "three four"]) == []
    many = ["3 pages are over the budget of 2", "5 words are over the budget of 4"]
    assert pages.over_budget(["one two", "three four", "five"]) == many


def test_the_site_loads_nothing_from_the_web():
    html = '<img src="a.png"><a href="https://a.org"><script async src="https://b.org/c.js"></script>'
    assert loaded_from_outside(html) == ["https://b.org/c.js comes from the web"]


def test_artists_pages_are_in_the_first_parts_of_the_index():
    part = "```{{toctree}}\n:caption: {}\n:maxdepth: 1\n\n{}\n```\n"
    index = part.format("Start", "first") + part.format("Guide", "lights\nsnakes") + part.format("Science", "theory")
    assert pages.artists_pages(index) == {"first", "lights", "snakes"}
