# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays in a material.

From Blender 5.1 on, the Raycast node traces them. In earlier versions the trace() function of a script does. Cycles on
the CPU runs the script where Open Shading Language is switched on. Every other renderer passes over the script, and
then nothing is shaded.
"""

from pathlib import Path

import bpy

from ..blender import compat
from ..nodes.builder import Operand, Tree, Value

_TEXT = "Diffraction Shadow.osl"
_RAYCAST = "ShaderNodeRaycast"
# What Blender makes of a node that it does not have. Its outputs are 0.5.
_UNDEFINED = "NodeUndefined"
_SOURCE = Path(__file__).parent / "osl" / "shadow.osl"


def ray_start(tree: Tree, geometry: bpy.types.Node) -> Value:
    """Where shadow rays start: a tenth of a pixel above the surface, by a Geometry node. A ray that starts on the edge
    of a triangle would hit its neighbour."""
    position, normal = (tree.value(geometry.outputs[name]) for name in ("Position", "True Normal"))
    away = tree.value(tree.node("ShaderNodeCameraData").outputs["View Distance"])
    return normal.times_plus(away * 1e-4, position)


def hit(tree: Tree, start: Value, direction: Value, *, distance: Operand) -> Value | float:
    """1 where something stands between the start and the lamp, else 0.

    In a Blender that has neither a Raycast node nor Open Shading Language it is the constant 0."""
    if compat.HAS_RAYCAST:
        return tree.value(tree.node(_RAYCAST, start, direction, distance).outputs["Is Hit"])
    node = tree.node("ShaderNodeScript", label="Shadow")
    render = bpy.context.scene.render
    chosen = render.engine
    try:
        render.engine = "CYCLES"  # Blender compiles a script under no other
        node.mode, node.script = "INTERNAL", _text()
    finally:
        render.engine = chosen
    if not node.bytecode or len(node.inputs) != 3:
        tree.tree.nodes.remove(node)
        return 0.0
    for socket, value in zip(node.inputs, (start, direction, distance), strict=True):
        tree.feed(socket, value)
    # A renderer that passes over the script takes the default of the socket that is linked to it. A Math node's default
    # is 0.5, so it is set to 0 here.
    add = tree.node("ShaderNodeMath", 0.0, 0.0, operation="ADD")
    tree.feed(add.inputs[0], tree.value(node.outputs["Hit"]))
    return tree.value(add.outputs[0])


def is_of_other_version(group: bpy.types.NodeTree, *, traced: bool) -> bool:
    """Whether a Diffraction group was saved by a Blender that traces shadow rays in another way than this one does:
    this Blender has no such node, or it has the Raycast node and the group lacks it. `traced`: the group has shadows.

    A group in which an earlier Blender could not compile the script has no node for shadows, which is right there."""
    kinds = {node.bl_idname for node in group.nodes}
    return _UNDEFINED in kinds or (traced and compat.HAS_RAYCAST and _RAYCAST not in kinds)


def _text() -> bpy.types.Text:
    """The file's copy of the script, made if need be."""
    found = bpy.data.texts.get(_TEXT)
    if found is None or found.library is not None:
        found = bpy.data.texts.new(_TEXT)
        found.from_string(_SOURCE.read_text(encoding="utf-8"))
    return found
