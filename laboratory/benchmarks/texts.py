# SPDX-License-Identifier: GPL-3.0-or-later
"""All texts of the add-on that an artist reads, in one list by file: labels, tooltips, notes, errors and reports.

    ./dev bench texts

Read the list aloud after a change of the panel. The texts come from the syntax trees, so Blender does not start. A part
that is known only when Blender runs stands in braces, as in the source.
"""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from precompute.cli.parser import OneLineParser

ROOT = Path(__file__).resolve().parents[2]
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
_LABELS = {"bl_label", "bl_description", "bl_category"}
# The texts of an input or output of a node, by their places in the call.
_SOCKET = {0: "name", 2: "description"}
# Two words side by side, which formulas and the names of things in the code lack.
_WORDS = re.compile(r"\w[,;:.)}\"']* [({\"']*[^\W\d]")
_TEXT = (ast.Constant, ast.JoinedStr)
# Calls whose texts are known by the name of the function.
_CALLS = {"GratingError": "error", "report": "report", "report_lines": "report"}


@dataclass(frozen=True)
class UserText:
    """A text, the line of its source, and its place in Blender: label, tooltip, name, item, error, report or note."""

    line: int
    kind: str
    text: str


def main(argv: list[str] | None = None) -> int:
    """Print the list and return the exit status."""
    OneLineParser(prog="./dev bench texts", description=__doc__.splitlines()[0]).parse_args(argv)
    counts: Counter[str] = Counter()
    for path in sorted((ROOT / "addon").rglob("*.py")):
        texts = artist_texts(ast.parse(path.read_text(encoding="utf-8")))
        counts.update(text.kind for text in texts)
        if texts:
            print(path.relative_to(ROOT).as_posix())
        for text in texts:
            print(f"{text.line:5} {text.kind:12}{text.text}")
    print(f"{counts.total()} texts: {', '.join(f'{kind} {count}' for kind, count in sorted(counts.items()))}")
    return 0


def user_texts(tree: ast.Module, *, tooltips: bool) -> list[str]:
    """A source's texts except docstrings; `tooltips` includes those of classes, which Blender shows."""
    hidden = _docstrings(tree, (ast.Module, *_FUNCTIONS) + (() if tooltips else (ast.ClassDef,)))
    return [node.value for node in ast.walk(tree) if _is_string(node) and id(node) not in hidden]


def artist_texts(tree: ast.Module) -> list[UserText]:
    """A source's texts that an artist can see, in the order of their lines. Where it is not known that Blender shows a
    text, it counts if it has two words."""
    parents = {child: node for node in ast.walk(tree) for child in ast.iter_child_nodes(node)}
    hidden = _docstrings(tree, (ast.Module, *_FUNCTIONS))
    found = []
    for node in ast.walk(tree):
        if not isinstance(node, _TEXT) or id(node) in hidden or _is_inside_a_text(node, parents):
            continue
        text = "".join(_parts(node))
        kind = _kind(node, parents)
        if kind is not None and (_WORDS.search(text) if kind == "note" else re.search("[a-z]", text)):
            found.append(UserText(node.lineno, kind, " ".join(text.split())))
    return sorted(found, key=lambda text: text.line)


def _docstrings(tree: ast.Module, holders: tuple[type, ...]) -> set[int]:
    """The ids of the docstrings that belong to nodes of these types."""
    return {id(node.body[0].value) for node in ast.walk(tree)
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
    if _called(parent) == "Socket" and node in parent.args:
        return _SOCKET.get(parent.args.index(node))
    while not isinstance(parent, ast.stmt):
        if isinstance(parent, ast.keyword) and parent.arg == "text":
            return "label"
        if isinstance(parent, ast.keyword) and _called(parents[parent]).endswith("Property"):
            return parent.arg if parent.arg in ("name", "description") else None
        if (kind := _CALLS.get(_called(parent))) is not None:
            return kind
        parent = parents[parent]
    return "note"


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
