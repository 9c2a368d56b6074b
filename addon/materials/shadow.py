# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays: Blender's Raycast node where there is one, before that OSL's trace(), which Cycles on the CPU runs where
Open Shading Language is switched on and all else passes over."""

from pathlib import Path

import bpy

from ..nodes.builder import Tree, Value
from ..scene import compat

_TEXT = "Diffraction Shadow.osl"


_SOURCE = Path(__file__).parent / "osl" / "shadow.osl"


def hit(tree: Tree, start: Value, wi: Value, distance: Value) -> Value | float:
    """1 where something stands between a start and its lamp; 0 for good in a Blender with neither way."""
    if compat.HAS_RAYCAST:
        return tree.value(tree.node("ShaderNodeRaycast", start, wi, distance).outputs["Is Hit"])
    node = tree.node("ShaderNodeScript", label="Shadow")
    render = bpy.context.scene.render
    chosen = render.engine
    render.engine = "CYCLES"  # Blender compiles a script under no other
    node.mode, node.script = "INTERNAL", _text()
    render.engine = chosen
    if not node.bytecode or len(node.inputs) != 3:
        tree.tree.nodes.remove(node)
        return 0.0
    for socket, value in zip(node.inputs, (start, wi, distance), strict=True):
        tree.feed(socket, value)
    # A renderer that passes the script over takes what the linked socket itself holds, of which the default is a half.
    add = tree.node("ShaderNodeMath", 0.0, 0.0, operation="ADD")
    tree.feed(add.inputs[0], tree.value(node.outputs["Hit"]))
    return tree.value(add.outputs[0])


def _text() -> bpy.types.Text:
    """The file's copy of the script, made if need be."""
    found = bpy.data.texts.get(_TEXT)
    if found is None or found.library is not None:
        found = bpy.data.texts.new(_TEXT)
        found.from_string(_SOURCE.read_text())
    return found
