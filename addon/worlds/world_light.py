# SPDX-License-Identifier: GPL-3.0-or-later
"""How bright a world is, as far as its nodes tell."""

import math

import bpy

from ..blender import compat


def world_light(world: bpy.types.World | None) -> float:
    """The radiance of a world by its brightest Background node; infinite if other nodes set it."""
    if world is None:
        return 0.0
    tree = compat.world_nodes(world)
    if tree is None:
        return max(world.color)
    shown = [node for node in tree.nodes if node.type == "BACKGROUND"]
    return max((_light_of(node) for node in shown), default=math.inf)


def _light_of(background: bpy.types.Node) -> float:
    light = 1.0
    for socket in (background.inputs["Strength"], background.inputs["Color"]):
        value = socket.default_value
        light *= math.inf if socket.is_linked else max(value[:3]) if socket.type == "RGBA" else value
    return 0.0 if math.isnan(light) else light  # a strength of 0 of a picture
