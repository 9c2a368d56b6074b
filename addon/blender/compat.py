# SPDX-License-Identifier: GPL-3.0-or-later
"""All differences between Blender versions 4.5 to 5.3."""

import bpy

# Whether materials have a Raycast node. It hits all objects in Cycles, and objects on screen in EEVEE.
HAS_RAYCAST = bpy.app.version >= (5, 1, 0)
# Whether materials have loops (Repeat Zones), which stay loops in EEVEE. Cycles repeats their nodes. Only 4.5, 5.2 and
# 5.3 were tried.
HAS_LOOPS = bpy.app.version >= (5, 2, 0)
# Whether EEVEE's Attribute node reads vertex groups. In 4.5 it gives 0, in 5.2 the weights. Others were not tried.
EEVEE_READS_VERTEX_GROUPS = bpy.app.version >= (5, 2, 0)
# Whether EEVEE computes what depends on constants alone before it writes a shader. Only 4.5 and 5.2 were tried.
EEVEE_EVALUATES_CONSTANTS = bpy.app.version >= (5, 2, 0)
# Whether EEVEE draws the sun of a Sky Texture with its disc on. 5.2 does not, 5.3 does.
EEVEE_DRAWS_SUN_DISC = bpy.app.version >= (5, 3, 0)
# So many lamps with a place leave a material room in Cycles, whose shaders hold 255 numbers at once. In 4.5 what
# depends on a Bump node is computed last, and all lamps wait for it.
LAMPS_IN_CYCLES = 32 if bpy.app.version >= (5, 0, 0) else 12


def eevee_engine() -> str:
    """The identifier of the EEVEE engine, which changed in Blender 5.0."""
    return "BLENDER_EEVEE" if bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT"


def write_pictures(settings: bpy.types.ImageFormatSettings, file_format: str) -> None:
    """Set the output to single pictures of a file format. From Blender 5.0 on, the media type must be set first."""
    if bpy.app.version >= (5, 0, 0):
        settings.media_type = "IMAGE"  # type: ignore[attr-defined]  # since Blender 5.0
    settings.file_format = file_format  # type: ignore[assignment]  # the stubs list the names


def enable_nodes(material: bpy.types.Material | bpy.types.World | bpy.types.Light) -> None:
    """Enable the nodes of a new material, world or lamp. Does nothing from Blender 5.0 on (they are always enabled)."""
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True


def lamp_nodes(lamp: bpy.types.Light) -> bpy.types.NodeTree | None:
    """A lamp's node tree if its nodes are enabled, else None. Blender 5 warns if use_nodes is read, and Blender 6.0
    removes it."""
    return lamp.node_tree if bpy.app.version >= (5, 0, 0) or lamp.use_nodes else None


def world_nodes(world: bpy.types.World) -> bpy.types.NodeTree | None:
    """A world's node tree if its nodes are enabled, else None, as in lamp_nodes."""
    return world.node_tree if bpy.app.version >= (5, 0, 0) or world.use_nodes else None


def texture_scale(scene: bpy.types.Scene) -> float:
    """Simplify's texture scale in Cycles, the smaller of the viewport's and the render's; 1 before Blender 5.2."""
    names = ("texture_resolution", "texture_resolution_render")
    return min(getattr(scene.cycles, name, 1.0) for name in names)


def has_texture_cache(scene: bpy.types.Scene) -> bool:
    """Whether Cycles may load reduced versions of image files (the texture cache of Blender 5.2)."""
    return getattr(scene.render, "use_texture_cache", False)


def annotation_of(scene: bpy.types.Scene) -> bpy.types.ID | None:
    """The scene's annotations, or None. Before Blender 5.0 the property is called grease_pencil."""
    return scene.annotation if bpy.app.version >= (5, 0, 0) else scene.grease_pencil  # type: ignore[attr-defined]  # since Blender 5.0


def append_from(library: bpy.types.UserAssetLibrary) -> None:
    """Let the Asset Browser append a library's assets, so that they can be edited. Blender 5.2 packs linked copies by
    default, and does not let a library choose Append (Reuse Data), which shares the pictures of an asset used twice."""
    library.import_method = "APPEND" if bpy.app.version >= (5, 0, 0) else "APPEND_REUSE"


def prefer_append(asset: bpy.types.AssetMetaData) -> None:
    """Let the Asset Browser append an asset by default, from any library. Only Blender 5.2 has this setting."""
    if hasattr(asset, "preferred_import_method"):
        asset.use_preferred_import_method = True  # type: ignore[attr-defined]  # since Blender 5.2
        asset.preferred_import_method = "APPEND"


def remove_replaced(block: bpy.types.ID) -> None:
    """Delete an unused data-block that another one has replaced. A node group is only emptied before Blender 5.0, and
    is not saved. After its deletion an undo may crash: Blender follows the pointers of a group that it restores before
    it maps them, and the group may lie where the deleted one lay."""
    if isinstance(block, bpy.types.NodeTree) and bpy.app.version < (5, 0, 0):
        block.nodes.clear()
        for key in list(block.keys()):  # what marks it as a part of a grating
            del block[key]
        block.name = f"Replaced {block.name}"
        return
    bpy.data.batch_remove([block])
