# SPDX-License-Identifier: GPL-3.0-or-later
"""All texts of the add-on that an artist reads: labels, tooltips, notes, errors and reports.

`python -m devtools.docs.user_texts > texts.pot` writes those that Blender can look up in a translation, as a gettext
template: all except f-strings with values. The texts come from the syntax trees, so Blender does not start. A part that
is known only when Blender runs stands in braces, as in the source."""

import ast
import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from .. import ROOT
from ..changed import tree_of

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
_LABELS = {"bl_label", "bl_description", "bl_category"}
# The texts of an input or output of a node, and of a quality, by their places in the call.
_POSITIONS = {"Socket": {0: "name", 2: "description"}, "Quality": {1: "item", 2: "item"}}
# Two words side by side, which formulas and the names of things in the code lack.
_WORDS = re.compile(r"\w[,;:.)}\"']* [({\"']*[^\W\d]")
_TEXT = (ast.Constant, ast.JoinedStr)
# Calls whose texts are known by the name of the function.
_CALLS = {"GratingError": "error", "report": "report"} | dict.fromkeys(("translated", "counted", "marked"), "text")
# Blender looks up the labels and buttons of operators in a context of their own.
_OPERATOR = "Operator"
_HEADER = 'msgid ""\nmsgstr ""\n"Content-Type: text/plain; charset=UTF-8\\n"\n'


@dataclass(frozen=True)
class UserText:
    """A text, the line of its source, and its place in Blender: label, tooltip, name, item, text, error, report or
    note. `context` is the one in which Blender translates it. `is_fixed`: it is no f-string with values."""

    line: int
    kind: str
    text: str
    context: str = ""
    is_fixed: bool = True


def template() -> str:
    """The texts that can be translated, as a gettext template: the add-on's, the errors of precompute, which Blender
    reports, and the titles of the presets."""
    places: dict[tuple[str, str], list[str]] = {}
    for path in (path for folder in ("addon", "precompute") for path in sorted((ROOT / folder).rglob("*.py"))):
        shown = path.is_relative_to(ROOT / "addon")
        for text in texts_of(path):
            if text.is_fixed and (shown or text.kind == "error"):
                place = f"{path.relative_to(ROOT).as_posix()}:{text.line}"
                places.setdefault((text.context, text.text), []).append(place)
    for path, title in preset_titles().items():
        places.setdefault(("", title), []).append(path)
    return "\n".join([_HEADER, *(_entry(*key, found) for key, found in places.items())])


def preset_titles() -> dict[str, str]:
    """The title of each preset, by the path of its file in the repository."""
    files = sorted((ROOT / "precompute" / "presets").glob("*.json"))
    return {path.relative_to(ROOT).as_posix(): json.loads(path.read_bytes())["title"] for path in files}


def _entry(context: str, text: str, places: list[str]) -> str:
    lines = [f"#: {' '.join(places)}", *([f'msgctxt "{context}"'] if context else [])]
    quoted = text.replace("\\", "\\\\").replace('"', '\\"')
    return "\n".join([*lines, f'msgid "{quoted}"', 'msgstr ""', ""])


def user_texts(tree: ast.Module, *, tooltips: bool) -> list[str]:
    """A source's texts except docstrings; `tooltips` includes those of classes, which Blender shows."""
    nodes = list(ast.walk(tree))
    hidden = _docstrings(nodes, (ast.Module, *_FUNCTIONS) + (() if tooltips else (ast.ClassDef,)))
    return [node.value for node in nodes if _is_string(node) and id(node) not in hidden]


@cache
def texts_of(path: Path) -> list[UserText]:
    """The texts of a source that an artist can see."""
    return artist_texts(tree_of(path))


def artist_texts(tree: ast.Module) -> list[UserText]:
    """A source's texts that an artist can see, in the order of their lines. Where it is not known that Blender shows a
    text, it counts if it has two words."""
    parents = _parents(tree)
    hidden = _docstrings([tree, *parents], (ast.Module, *_FUNCTIONS))
    found = []
    for node in parents:
        if not isinstance(node, _TEXT) or id(node) in hidden or _is_inside_a_text(node, parents):
            continue
        text = "".join(_parts(node))
        kind = _kind(node, parents)
        if kind is not None and (_WORDS.search(text) if kind == "note" else re.search("[a-z]", text)):
            is_fixed = not any(isinstance(part, ast.FormattedValue) for part in ast.walk(node))
            context = _OPERATOR if _is_of_operator(node, kind, parents) else ""
            found.append(UserText(node.lineno, kind, " ".join(text.split()), context, is_fixed))
    return sorted(found, key=lambda text: text.line)


def _parents(tree: ast.Module) -> dict[ast.AST, ast.AST]:
    """The parent of each node below the module. One walk: it takes most of the time of all texts."""
    parents: dict[ast.AST, ast.AST] = {}
    nodes: list[ast.AST] = [tree]
    for node in nodes:
        for child in ast.iter_child_nodes(node):
            parents[child] = node
            nodes.append(child)
    return parents


def _docstrings(nodes: Iterable[ast.AST], holders: tuple[type, ...]) -> set[int]:
    """The ids of the docstrings that belong to nodes of these types."""
    return {id(node.body[0].value) for node in nodes
            if isinstance(node, holders) and ast.get_docstring(node) is not None}  # fmt: skip


def _is_string(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _is_inside_a_text(node: ast.AST, parents: dict[ast.AST, ast.AST]) -> bool:
    """Whether a text stands in the braces of another one, which is listed with its braces."""
    while not isinstance(node, ast.stmt):
        node = parents[node]
        if isinstance(node, ast.JoinedStr):
            return True
    return False


def _parts(node: ast.AST) -> Iterator[str]:
    """A text's parts, with the source of each expression of an f-string in braces."""
    if isinstance(node, ast.JoinedStr):
        for part in node.values:
            yield from _parts(part) if isinstance(part, ast.Constant) else ("{" + ast.unparse(part.value) + "}",)
    elif _is_string(node):
        yield node.value


def _kind(node: ast.AST, parents: dict[ast.AST, ast.AST]) -> str | None:
    """Where Blender shows a text, from the nodes around it; None if it shows it nowhere."""
    parent = parents[node]
    if isinstance(parent, ast.Expr):
        holder = parents[parent]
        return "tooltip" if isinstance(holder, ast.ClassDef) and _is_shown(holder) else None
    if isinstance(parent, ast.Assign) and any(getattr(target, "id", "") in _LABELS for target in parent.targets):
        return "label"
    if isinstance(parent, ast.Tuple) and _is_item(parent):
        return None if parent.elts[0] is node else "item"
    if isinstance(parent, ast.Subscript):
        return None
    for call, kinds in _POSITIONS.items():
        if _called(parent) == call and node in parent.args:
            return kinds.get(parent.args.index(node))
    while not isinstance(parent, ast.stmt):
        if isinstance(parent, ast.keyword) and parent.arg == "text":
            return "label"
        if isinstance(parent, ast.keyword) and _called(parents[parent]).endswith("Property"):
            return parent.arg if parent.arg in ("name", "description") else None
        if (kind := _CALLS.get(_called(parent))) is not None:
            return kind
        parent = parents[parent]
    return "note"


def _is_of_operator(node: ast.AST, kind: str, parents: dict[ast.AST, ast.AST]) -> bool:
    """Whether a text is the label or the tooltip of an operator, or the text of its button."""
    parent = parents[node]
    while isinstance(parent, ast.IfExp):
        parent = parents[parent]
    if isinstance(parent, ast.keyword) and parent.arg == "text":
        return _called(parents[parent]).startswith("operator")
    holder = parents[parent]
    bases = [ast.unparse(base) for base in holder.bases] if isinstance(holder, ast.ClassDef) else []
    return kind in ("label", "tooltip") and "bpy.types.Operator" in bases


def _is_shown(node: ast.ClassDef) -> bool:
    """Whether Blender shows the docstring of a class as a tooltip."""
    return any(ast.unparse(base).startswith("bpy.types.") for base in node.bases) and any(
        isinstance(line, ast.Assign) and getattr(line.targets[0], "id", "") == "bl_idname" for line in node.body
    )


def _is_item(node: ast.Tuple) -> bool:
    """Whether a tuple is an item of a menu: its identifier, its label and its tooltip."""
    return len(node.elts) >= 3 and _is_string(node.elts[1]) and " " in "".join(_parts(node.elts[2]))


def _called(node: ast.AST) -> str:
    """The name of the function that a node calls, empty if it is no call."""
    if not isinstance(node, ast.Call):
        return ""
    return getattr(node.func, "attr", getattr(node.func, "id", ""))


if __name__ == "__main__":
    print(template())
