# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages, tooltips and help texts must not cite pages and commands that the zip lacks; checked in the syntax trees.
And the list of all texts."""

import ast
import re

import pytest

from devtools.docs.user_texts import artist_texts, template, user_texts

from .test_layering import ROOT, sources, tree_of

# Pages, folders and commands of the repository, none of which the zip holds.
_PAGE = re.compile(r"\bdocs/|\w\.md\b|\b(README|CHANGELOG|SECURITY|CONTRIBUTING)\b|\./dev\b|\b(laboratory|devtools)\b")
# Files of the add-on with texts that Blender shows or runs.
_DATA = (".json", ".osl")


def test_no_text_for_users_cites_a_page_that_the_zip_lacks():
    cited = []
    for path in [*sources("addon"), *sources("precompute")]:
        name = path.relative_to(ROOT).as_posix()
        texts = user_texts(tree_of(path), tooltips=name.startswith(("addon/operators/", "addon/ui/")))
        cited += [f"{name}: {text:.90}" for text in texts if _PAGE.search(text)]
    for path in (each for package in ("addon", "precompute") for each in (ROOT / package).rglob("*")):
        if path.suffix in _DATA and (found := _PAGE.search(path.read_text(encoding="utf-8"))):
            cited.append(f"{path.relative_to(ROOT).as_posix()}: {found[0]}")
    assert cited == []


@pytest.mark.parametrize(
    "text", ["see docs/a", "in needs.md", "see README", "run ./dev bench", "`python -m laboratory`", "SECURITY says it"]
)
def test_each_kind_of_citation_is_known(text):
    assert _PAGE.search(text)


def test_other_texts_are_no_citations():
    assert not _PAGE.search("a device's document, as blender --command grating --help says in needs.json")


def test_a_citation_would_be_found():
    source = '"""docs/a.md"""\nclass A:\n    """docs/b.md"""\n    x = f"see docs/c.md {1}"\n'
    assert user_texts(ast.parse(source), tooltips=False) == ["see docs/c.md "]
    assert user_texts(ast.parse(source), tooltips=True) == ["docs/b.md", "see docs/c.md "]


def test_the_list_of_texts_has_each_kind_and_leaves_the_code_out():
    source = '''"""A module."""
class A(bpy.types.Operator):
    """Bake it. Esc cancels"""
    bl_idname = "grating.a"
    bl_label = "Bake"
    width: FloatProperty(name="Width", description="In micrometres", subtype="DISTANCE")
    kind: EnumProperty(items=((SUN, "Sun", "One small sun"), ("SKY", "Sky", "The whole sky")))
    def draw(self, layout):
        """Draw it."""
        layout.label(text=f"{self.lamps:.0f} lamps", icon="LIGHT")
        raise GratingError(self.name, "too large", f"use {'a smaller' or 'one'}")
        self.report({"INFO"}, "made")
        note = "Select a mesh first"
        Socket("Turn", "Float", "Degrees")
        layout.operator("grating.a", text="Bake" if new else "Again")
        layout.label(text=translated("{name} (hidden)", name=lamp.name))
        value = scene["not a text"] + driver("2 * a")
'''
    assert [(text.line, text.kind, text.text) for text in artist_texts(ast.parse(source))] == [
        (3, "tooltip", "Bake it. Esc cancels"),
        (5, "label", "Bake"),
        (6, "name", "Width"),
        (6, "description", "In micrometres"),
        (7, "item", "Sun"),
        (7, "item", "One small sun"),
        (7, "item", "Sky"),
        (7, "item", "The whole sky"),
        (10, "label", "{self.lamps} lamps"),
        (11, "error", "too large"),
        (11, "error", "use {'a smaller' or 'one'}"),
        (12, "report", "made"),
        (13, "note", "Select a mesh first"),
        (14, "name", "Turn"),
        (14, "description", "Degrees"),
        (15, "label", "Bake"),
        (15, "label", "Again"),
        (16, "text", "{name} (hidden)"),
    ]
    fixed = [text for text in artist_texts(ast.parse(source)) if text.is_fixed]
    assert [text.text for text in artist_texts(ast.parse(source)) if text not in fixed] == [
        "{self.lamps} lamps",
        "use {'a smaller' or 'one'}",
    ]
    assert {text.text for text in fixed if text.context == "Operator"} == {"Bake it. Esc cancels", "Bake", "Again"}


def test_the_template_of_a_translation_has_each_text_once_with_its_places():
    found = template()
    keys = re.findall(r'(?:msgctxt "(\w+)"\n)?msgid "(.*)"\nmsgstr ""\n', found)
    assert len(keys) == len(set(keys)) > 1000
    assert {("", "Put on {name}"), ("Operator", "Bake Grating"), ("", "Corn Snake")} <= set(keys)
    assert re.search(r'#: addon/ui/panel.py:\d+\nmsgid "Put on \{count\} Meshes"\n', found)
