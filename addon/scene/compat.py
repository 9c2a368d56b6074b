# SPDX-License-Identifier: GPL-3.0-or-later
"""Every difference between Blender versions, 4.5 to 5.2, in one place."""

import bpy

# The Raycast node of materials: true shadows in Cycles, of what is on screen in EEVEE.
HAS_RAYCAST = bpy.app.version >= (5, 1, 0)


def working_space() -> str:
    """The file's linear working space, as precompute.colour names it. Blender 5.0 made it a choice."""
    if bpy.app.version < (5, 0, 0):
        return "Rec.709"
    return bpy.data.colorspace.working_space.removeprefix("Linear ")


def eevee_engine() -> str:
    """EEVEE's identifier, which lost its NEXT in 5.0."""
    return "BLENDER_EEVEE" if bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT"


def enable_nodes(material: bpy.types.Material) -> None:
    """Nodes are on from the start from 5.0, where setting them warns."""
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True


def lamp_nodes(lamp: bpy.types.Light) -> bpy.types.NodeTree | None:
    """The nodes that make a lamp's light, if any; asking whether they are on warns from 5.0, where they always are."""
    return lamp.node_tree if bpy.app.version >= (5, 0, 0) or lamp.use_nodes else None
