# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages in an artist's words: settings by their labels, and files of the cache by their names."""

import ast
import re
from types import SimpleNamespace

import bpy
import pytest

from devtools import ROOT

# The rooms of precompute whose messages reach an artist.
ROOMS = ("base", "maths", "optics", "colour", "surface", "spectra", "table", "reference", "measure", "bake", "methods")
# Of Gwyddion's command line, and of `--level` itself.
OPTIONS_OF_OTHERS = {"--convert-to-gwy", "--level"}


def texts_of(path):
    """The texts of a source file, docstrings apart."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and isinstance(node.body[0], ast.Expr)
    }
    return [n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and isinstance(n.value, str)
            and id(n) not in docstrings]  # fmt: skip


def error_of(addon, *fields):
    return addon.wording.GratingError(*fields)


def test_every_setting_has_a_label(addon):
    assert set(addon.wording.LABELS) == set(addon.wording.Setting)


def test_no_message_for_an_artist_names_an_option(addon):
    """It names a Setting, of which each side knows the name."""
    named = {
        option
        for room in ROOMS
        for path in (ROOT / "precompute" / room).rglob("*.py")
        if path.name != "failure.py"
        for text in texts_of(path)
        for option in re.findall(r"--[a-z][a-z-]*", text)
    }
    assert named == OPTIONS_OF_OTHERS


def test_the_labels_are_those_of_the_interface(addon):
    dialog = bpy.ops.grating.import_height_map.get_rna_type().properties
    panel = addon.grating.Grating.bl_rna.properties
    labels, setting = addon.wording.LABELS, addon.wording.Setting
    for name in ("size_um", "height_nm", "channel"):
        assert labels[setting[name.upper()]] == f"{dialog[name].name} in the import dialog"
    for name in ("delta_e", "coherence_um", "spread_deg", "matter"):
        assert labels[setting[name.upper()]] == panel[name].name
    assert labels[setting.LEVEL] == panel["steps"].name
    method = bpy.ops.grating.osl_reference.get_rna_type().properties["method"]
    assert labels[setting.METHOD] == method.name
    assert labels[setting.NEEDS] == addon.bake.BakeNeeds.bl_label


def test_each_side_says_a_message_in_its_own_words(addon):
    setting = addon.wording.Setting
    error = error_of(
        addon, "a.png", "misses", ("ask for ", setting.DELTA_E, " 1.2 or a shorter ", setting.COHERENCE_UM)
    )
    assert str(error) == "a.png: misses; ask for --delta-e 1.2 or a shorter --coherence-um"
    assert addon.wording.in_words(error) == "a.png: misses; ask for Colour Error 1.2 or a shorter Coherence"


def test_an_option_in_a_files_name_is_no_setting(addon):
    error = error_of(addon, "a --size-um W.png", "broken", "copy it again")
    assert addon.wording.in_words(error) == str(error)


@pytest.mark.parametrize("kind", [str, lambda path: path])
def test_a_file_in_the_cache_has_its_name_for_its_path(addon, kind):
    inside = addon.cache_folder.cache_folder() / "entries" / "0123" / "skin.exr"
    assert addon.wording.in_words(error_of(addon, kind(inside), "broken", "bake it again")) == (
        "skin.exr in the cache: broken; bake it again"
    )
    folder = kind(inside.parent)
    assert addon.wording.in_words(error_of(addon, folder, "broken", "")) == "the cache: broken", "its name is a hash"
    beside = inside.parents[3] / "skin.exr"
    assert addon.wording.in_words(error_of(addon, kind(beside), "broken", "bake it again")).startswith(f"{beside}: ")


def test_a_message_is_one_printable_line(addon):
    assert addon.wording.in_words("a\nb") == "a\\nb"
    assert addon.wording.in_words(error_of(addon, "a\x1b.png", "broken", "")) == "a\\x1b.png: broken"


def test_a_summary_in_one_line(addon):
    assert addon.wording.in_one_line("3 x 3 um\nrelief 1 nm") == "3 x 3 um, relief 1 nm"
    assert addon.wording.in_one_line("") == ""


def test_a_finding_on_a_scan_names_levelling(addon):
    """The scan's quality, as a .blend keeps it, holds an artist's words."""
    bake_it = ("3 % of it is like dust; bake it with ", addon.wording.Setting.LEVEL, " plane,dust")
    finding = SimpleNamespace(topic="dirt", light="usable", words=bake_it)
    known = SimpleNamespace(quality=SimpleNamespace(light="usable", findings=[finding]))
    told = "usable\ndirt: usable; 3 % of it is like dust; bake it with Levelling plane,dust"
    assert addon.importing.quality_of([("scan", known)]) == told
