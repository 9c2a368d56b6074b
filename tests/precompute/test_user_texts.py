# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages, tooltips and help texts must not cite pages that the zip lacks; checked in the syntax trees."""

import ast
import re

from .test_layering import ROOT, sources, tree_of

# Pages of the repository, none of which the zip holds.
_PAGE = re.compile(r"\bdocs/|\w\.md\b|\bREADME\b")


def user_texts(tree, *, tooltips):
    """A source's texts except docstrings; `tooltips` includes those of classes, which Blender shows."""
    holders = (ast.Module, ast.FunctionDef, ast.AsyncFunctionDef) + (() if tooltips else (ast.ClassDef,))
    docstrings = {id(node.body[0].value) for node in ast.walk(tree)
                  if isinstance(node, holders) and ast.get_docstring(node) is not None}  # fmt: skip
    texts = (node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str))
    return [node.value for node in texts if id(node) not in docstrings]


def test_no_text_for_users_cites_a_page_that_the_zip_lacks():
    cited = []
    for path in [*sources("addon"), *sources("precompute")]:
        name = path.relative_to(ROOT).as_posix()
        texts = user_texts(tree_of(path), tooltips=name.startswith(("addon/operators/", "addon/ui/")))
        cited += [f"{name}: {text:.90}" for text in texts if _PAGE.search(text)]
    assert cited == []


def test_a_citation_would_be_found():
    source = '"""docs/a.md"""\nclass A:\n    """docs/b.md"""\n    x = f"see docs/c.md {1}"\n'
    assert user_texts(ast.parse(source), tooltips=False) == ["see docs/c.md "]
    assert user_texts(ast.parse(source), tooltips=True) == ["docs/b.md", "see docs/c.md "]
