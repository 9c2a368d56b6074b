# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of the pages in docs/: links, sentences, labels, pictures, figures, and the size of the site.

Each check is a function of a page's text and returns pairs: a line, and what is wrong there.
tests/precompute/test_project_pages.py and `./dev docs` run all of them. Printed commands are checked by that test, and
run by tests/package/test_printed_commands.py."""

import json
import re
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from .. import ROOT
from .user_texts import preset_titles, texts_of

DOCS = ROOT / "docs"
# The budget of the site. These numbers only go down.
PAGES_MAX, WORDS_MAX = 20, 30_000
SENTENCE_WORDS_MAX = 30
# The parts of the site whose pages name buttons and settings.
ARTISTS_PARTS = ("Start", "Guide")
# Texts on those pages that look like our labels: Blender's own labels, and names of species.
NOT_OURS = frozenset({
    "Add Remote Asset Library", "Adjust Last Operation", "Anisotropic Filtering", "Bump Map Correction",
    "Caustics > Reflective", "Clamping > Indirect Light", "Color", "EEVEE", "Elaphe guttata", "Filter Glossy",
    "High Quality Normals", "IOR", "Keep Boundaries", "Mesh", "Metallic", "Normalize", "Object",
    "Object > Relations > Make Local > All", "Object > Shading > Light Group",
    "Object > Visibility > Ray Visibility > Glossy", "Ray Visibility", "Sampling > Advanced", "Spread", "Sun Disc",
    "Temperature", "Xenopeltis unicolor",
})  # fmt: skip

# A place for figures in a page: in a line `<!-- NAME -->figure<!-- /NAME -->`, or with the figures in lines of their
# own. The commands of the laboratory fill it, and write the figures into this file of docs/ as well.
PLACE = re.compile(r"<!-- (?P<name>[^/>][^>]*) -->(?P<figure>.*?)<!-- /(?P=name) -->", re.DOTALL)
FIGURES = "figures.json"

Faults = list[tuple[int, str]]

# A link to a page, with or without an anchor, or to an anchor of the same page, but not into the web.
_LINK = re.compile(r"\]\((?!\w+:)([^)#\s]*)(?:#([^)\s]+))?\)")
_NO_PROSE = re.compile(r"^```.*?^```$|<!--.*?-->", re.MULTILINE | re.DOTALL)
_ITEM = re.compile(r"\s*(?:[-*+]|\d+\.) ")
_CODE, _TARGET = re.compile(r"`[^`]+`"), re.compile(r"\]\([^)]*\)")
_SENTENCE = re.compile(r"\S.*?(?:[.!?](?=[)*\"]*\s)|\Z)", re.DOTALL)
_EMPHASIS = re.compile(r"(?<![\w*\\])(\*\*?)(?=\S)([^*]+?)(?<=\S)\1(?![\w*])")
_TITLE_CASE = re.compile(r"[A-Z\d][\w']*(?: (?:[A-Z\d][\w']*|by|for|from|in|of|on|the|to|with|and))*\??")
_PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)]+)\)")
_CELL_CAPTION = re.compile(r"<br>([^|]+)")
_CAPTION, _COMMAND = re.compile(r"\n\n\*(?!\*)([^*]+)\*"), re.compile(r"`(?:\./dev|python -m)\s[^`]+`")


def faults_of_pages() -> list[str]:
    """The faults of all pages of the site, one line each with page and line, and dead links of the README and its
    neighbours."""
    pages = {page: page.read_text(encoding="utf-8") for page in sorted([*DOCS.glob("*.md"), *ROOT.glob("*.md")])}
    site = {page: text for page, text in pages.items() if page.parent == DOCS}
    artists, known = artists_pages(site[DOCS / "index.md"]), labels()
    figures, version = json.loads((DOCS / FIGURES).read_text(encoding="utf-8")), bake_version()
    found = [f"docs: {fault}" for fault in over_budget(site.values())]
    for page, text in pages.items():
        faults = dead_links(page, text)
        if page in site:
            faults += long_sentences(text) + bare_pictures(text)
            faults += old_figures(text, figures.get(page.name, {}), version)
        if page in site and page.stem in artists:
            faults += unknown_labels(text, known)
        found += [f"{page.relative_to(ROOT).as_posix()}:{line}: {what}" for line, what in sorted(faults)]
    return found


def over_budget(texts: Collection[str]) -> list[str]:
    """Pages and words over the budget. Words are counted as wc does, so tables and code count too."""
    words = sum(len(text.split()) for text in texts)
    counts = {"pages": (len(texts), PAGES_MAX), "words": (words, WORDS_MAX)}
    return [f"{count} {name} are over the budget of {most}" for name, (count, most) in counts.items() if count > most]


def dead_links(page: Path, text: str) -> Faults:
    """Links to files or anchors that do not exist. Links into the web are left to `./dev docs --external`."""
    found = []
    for link in _LINK.finditer(text):
        name, anchor = link.groups()
        target = page.parent / name if name else page
        if not target.exists() or anchor and anchor not in anchors(target.read_text(encoding="utf-8")):
            found.append((_line(text, link), f"the link {link[0][2:-1]} is dead"))
    return found


def old_figures(text: str, recorded: Mapping[str, Mapping[str, str | int]], version: int) -> Faults:
    """Figures in places of a page that no command of the laboratory wrote, or that it measured with bakes of another
    version. `recorded`: the page's part of FIGURES."""
    found = []
    for place in PLACE.finditer(text):
        own = recorded.get(place["name"], {})
        if own.get("figure") != place["figure"].strip():
            found.append((_line(text, place), f"the figure {place['name']} is not that of docs/{FIGURES}"))
        elif own.get("bake_version") != version:
            what = f"the figure {place['name']} is of bakes of version {own.get('bake_version')}, now {version}"
            found.append((_line(text, place), f"{what}; measure it again"))
    return found


def bake_version() -> int:
    """The version of bakes, read as text because the checks also run without NumPy."""
    text = (ROOT / "precompute" / "bake" / "cache.py").read_text(encoding="utf-8")
    (version,) = re.findall(r"^BAKE_VERSION = (\d+)$", text, re.MULTILINE)
    return int(version)


def anchors(text: str) -> set[str]:
    """The anchors of a page's titles, as GitHub and MyST make them."""
    titles = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def long_sentences(text: str) -> Faults:
    """Sentences of more than 30 words. Code in backticks is one word; tables, titles and blocks of code have none."""
    found = []
    for line, paragraph in paragraphs(text):
        plain = _TARGET.sub("]", _replaced(_CODE, "C", paragraph))
        for sentence in _SENTENCE.finditer(plain):
            words = [word for word in sentence[0].split() if re.search(r"\w", word)]
            if len(words) > SENTENCE_WORDS_MAX:
                what = f"a sentence of {len(words)} words: {' '.join(words[:5])} ..."
                found.append((line + plain.count("\n", 0, sentence.start()), what))
    return found


def paragraphs(text: str) -> Iterator[tuple[int, str]]:
    """The paragraphs and items of lists of a page, each with its first line."""
    block: list[str] = []
    for number, line in enumerate([*_replaced(_NO_PROSE, "", text).splitlines(), ""], 1):
        is_code = line.startswith("    ") and not block
        if not line.strip() or line.startswith(("|", "#")) or is_code or _ITEM.match(line):
            if block:
                yield number - len(block), "\n".join(block)
            block = [_ITEM.sub("", line, count=1)] if _ITEM.match(line) and not is_code else []
        else:
            block.append(line)


def unknown_labels(text: str, known: Collection[str]) -> Faults:
    """Labels that the add-on does not have. On a page of an artist's part, each text between stars is a label if its
    words begin with capitals, other than `by` or `for`, and no full stop ends it. A path of menus, A > B, has a label
    in each part. A label of the add-on with values, such as Put on {name}, stands for any value."""
    templates = [re.escape(label) for label in known if re.match(r"[A-Z]\w+ .*\{", label)]
    with_values = re.compile("|".join(re.sub(r"\\\{.*?\\\}", ".+", label) for label in templates) or "(?!)")
    found = []
    plain = _replaced(_CODE, "C", _replaced(_NO_PROSE, "", text))
    for emphasis in _EMPHASIS.finditer(plain):
        path = " ".join(_TARGET.sub("]", emphasis[2]).strip("[]").split())
        for label in [] if path in NOT_OURS else path.split(" > "):
            is_known = label in known or label in NOT_OURS or with_values.fullmatch(label)
            if _TITLE_CASE.fullmatch(label) and not is_known:
                found.append((_line(plain, emphasis), f"the add-on has no label {label}"))
    return found


def labels() -> set[str]:
    """All texts of the add-on that may be the label of a button, setting, menu, node or preset, without dots and units
    at their ends."""
    found = set(preset_titles().values())
    for path in (ROOT / "addon").rglob("*.py"):
        texts = [text.text for text in texts_of(path) if text.kind in ("label", "name", "item", "text", "note")]
        found |= {re.sub(r" \(\w+\)$|\.\.\.$", "", text) for text in texts}
    return found


def artists_pages(index: str) -> set[str]:
    """The names of the pages that the site's index lists in the parts of artists."""
    parts = re.findall(rf"^:caption: (?:{'|'.join(ARTISTS_PARTS)})$(.*?)^```$", index, re.MULTILINE | re.DOTALL)
    return set(re.findall(r"^\w+$", "\n".join(parts), re.MULTILINE))


def bare_pictures(text: str) -> Faults:
    """Pictures without alt text, caption or command. The caption is the next paragraph, in italics, with the command
    that makes the picture; a drawing (.svg) needs no command. In a table the caption stands below the picture, in its
    cell, and the page prints one command for all."""
    found = []
    for picture in _PICTURE.finditer(text):
        in_table = text.startswith("|", text.rfind("\n", 0, picture.start()) + 1)
        caption = (_CELL_CAPTION if in_table else _CAPTION).match(text, picture.end())
        lacks = [] if picture[1].strip() else ["alt text"]
        if caption is None:
            lacks.append("a caption in italics below it")
        elif not in_table and not picture[2].endswith(".svg") and not _COMMAND.search(caption[1]):
            lacks.append("the command that makes it in its caption")
        found += [(_line(text, picture), f"a picture without {what}") for what in lacks]
    return found


def _replaced(pattern: re.Pattern[str], by: str, text: str) -> str:
    """A text with all matches replaced. It keeps its lines."""
    return pattern.sub(lambda match: by + "\n" * match[0].count("\n"), text)


def _line(text: str, match: re.Match[str]) -> int:
    return text.count("\n", 0, match.start()) + 1
