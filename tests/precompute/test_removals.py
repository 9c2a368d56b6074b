# SPDX-License-Identifier: GPL-3.0-or-later
"""Names that Blender 5 marks for removal in Blender 6.0, checked in the syntax trees."""

import ast

import pytest

from .test_layering import ROOT, sources, tree_of

COMPAT = "addon/blender/compat.py"
# What Blender 5.3 marks so, without common words and without names that other types keep. Only line styles of Freestyle
# keep use_nodes. tests/addon/blender/test_removals.py asks Blender for its list.
REMOVED = {
    "animation_offset_end", "animation_offset_start", "compositing_node_group", "depth_order", "falloff_angle",
    "frame_final_duration", "frame_final_end", "frame_final_start", "frame_offset_end", "frame_offset_start",
    "invert_hardness_pressure", "mix_color", "show_stroke", "use_frontface_falloff", "use_nodes",
}  # fmt: skip
# Strips of the sequencer lose frame_start and frame_duration too, names that scenes and clips keep.
REMOVED_WITH_STRIPS = {"sequence_editor", "sequence_editor_create"}


def accesses(tree: ast.AST, names: set[str]) -> list[ast.AST]:
    """The places that read or set an attribute of one of these names, by a dot, by getattr or setattr, or in the path
    of a property."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr in names:
            found.append(node)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.rpartition(".")[2] in names:
            found.append(node)
    return found


def of_older_blenders(tree: ast.AST) -> set[ast.AST]:
    """The nodes inside `if bpy.app.version < (5, 0, 0):`, which Blender 5 and later skip."""
    guarded = (node for node in ast.walk(tree) if isinstance(node, ast.If))
    tests = {"bpy.app.version < (5, 0, 0)", "bpy.app.version < (5, 0)"}
    return {
        each for node in guarded if ast.unparse(node.test) in tests for part in node.body for each in ast.walk(part)
    }


def test_the_add_on_uses_no_removed_name_outside_compat():
    """In compat.py each use stands behind a comparison of versions."""
    found = {
        path.relative_to(ROOT).as_posix()
        for path in sources("addon")
        if accesses(tree_of(path), REMOVED | REMOVED_WITH_STRIPS)
    }
    assert found == {COMPAT}


@pytest.mark.parametrize("package", ["devtools", "laboratory", "sample_scenes", "tests"])
def test_scripts_use_removed_names_in_older_blenders_only(package):
    """Scripts that run without the extension compare Blender's version themselves."""
    found = []
    for path in sources(package):
        if not any(name in path.read_text(encoding="utf-8") for name in REMOVED | REMOVED_WITH_STRIPS):
            continue
        tree = tree_of(path)
        guarded = of_older_blenders(tree)
        found += [
            f"{path.relative_to(ROOT).as_posix()}:{node.lineno}"
            for node in accesses(tree, REMOVED | REMOVED_WITH_STRIPS)
            if node not in guarded and isinstance(node, ast.Attribute)
        ]
    assert found == []


def test_lists_have_no_columns():
    """Blender 6.0 drops the argument `columns` of template_list."""
    calls = [
        node
        for path in sources("addon")
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "template_list"
    ]
    assert calls
    assert not [call.lineno for call in calls if any(keyword.arg == "columns" for keyword in call.keywords)]


def test_each_way_to_a_removed_name_is_found():
    source = 'a.use_nodes = True\nsetattr(a, "use_nodes", 1)\na.keyframe_insert("material.use_nodes")\nuse_nodes = 1\n'
    assert [node.lineno for node in accesses(ast.parse(source), REMOVED)] == [1, 2, 3]
    tree = ast.parse("if bpy.app.version < (5, 0, 0):\n    a.use_nodes = True\nelse:\n    b.use_nodes = True\n")
    (_, left) = accesses(tree, REMOVED)
    assert [node for node in accesses(tree, REMOVED) if node not in of_older_blenders(tree)] == [left]
