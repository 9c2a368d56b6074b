# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays in a material.

From Blender 5.1 on, the Raycast node traces them. In earlier versions a script calls trace(); only Cycles on the CPU
with Open Shading Language runs it. Other renderers skip the script, and then there are no shadows."""

from pathlib import Path

import bpy

from ..blender import compat
from ..nodes.builder import Operand, Tree, Value
from ..nodes.interface import LOOP

_TEXT = "Diffraction Shadow.osl"
_RAYCAST = "ShaderNodeRaycast"
# The type of a node that this Blender does not know. Its outputs are 0.5.
_UNDEFINED = "NodeUndefined"
_SOURCE = Path(__file__).parent / "osl" / "shadow.osl"


def ray_start(tree: Tree, geometry: bpy.types.Node) -> Value:
    """The start of shadow rays: a tenth of a pixel above the surface, because a ray from a triangle's edge would hit
    the next triangle. `geometry` is a Geometry node."""
    position, normal = (tree.value(geometry.outputs[name]) for name in ("Position", "True Normal"))
    away = tree.value(tree.node("ShaderNodeCameraData").outputs["View Distance"])
    return normal.times_plus(away * 1e-4, position)


def hit(tree: Tree, start: Value, direction: Value, *, distance: Operand) -> Value | float:
    """1 if something stands between the start and the lamp, else 0. Constantly 0 without Raycast node and OSL."""
    if compat.HAS_RAYCAST:
        return tree.value(tree.node(_RAYCAST, start, direction, distance).outputs["Is Hit"])
    node = tree.node("ShaderNodeScript", label="Shadow")
    render = bpy.context.scene.render
    chosen = render.engine
    try:
        render.engine = "CYCLES"  # Blender compiles scripts for no other engine
        node.mode, node.script = "INTERNAL", _text()
    finally:
        render.engine = chosen
    if not node.bytecode or len(node.inputs) != 3:
        tree.tree.nodes.remove(node)
        return 0.0
    for socket, value in zip(node.inputs, (start, direction, distance), strict=True):
        tree.feed(socket, value)
    # A renderer that skips the script uses the default of the linked socket: 0.5 in a Math node, unless set to 0 here.
    add = tree.node("ShaderNodeMath", 0.0, 0.0, operation="ADD")
    tree.feed(add.inputs[0], tree.value(node.outputs["Hit"]))
    return tree.value(add.outputs[0])


def is_of_other_version(group: bpy.types.NodeTree, *, traced: bool) -> bool:
    """Whether this Blender would show a Diffraction group wrongly, because one with other nodes saved it: the group has
    a loop or a node that this Blender does not know, or lacks the Raycast node that this Blender has. `traced`: whether
    the group has shadows. A group without any shadow node is valid in earlier versions, because the script may not have
    compiled."""
    kinds = {node.bl_idname for node in group.nodes}
    unknown = _UNDEFINED in kinds or (LOOP in kinds and not compat.HAS_LOOPS)
    return unknown or (traced and compat.HAS_RAYCAST and _RAYCAST not in kinds)


def _text() -> bpy.types.Text:
    """The file's copy of the script, created if needed."""
    found = bpy.data.texts.get(_TEXT)
    if found is None or found.library is not None:
        found = bpy.data.texts.new(_TEXT)
        found.use_fake_user = False  # set on a new text; a purge of the file would leave it
        found.from_string(_SOURCE.read_text(encoding="utf-8"))
    return found
