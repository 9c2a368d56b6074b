# SPDX-License-Identifier: GPL-3.0-or-later
"""All differences between Blender versions 4.5 to 5.2.

Blender's windows: whether any exist, running in one, and redrawing their 3D views.

Whether a render runs in a background thread. While it does, it may read any data, so data must not change.

The time of the last change that Blender reported. Slow results are cached and recomputed only after a pause."""

import time
from contextlib import AbstractContextManager
from typing import Any

import bpy

# Whether materials have a Raycast node. It hits all objects in Cycles, and objects on screen in EEVEE.
HAS_RAYCAST = bpy.app.version >= (5, 1, 0)
# Whether EEVEE's Attribute node reads vertex groups. In 4.5 it gives 0, in 5.2 the weights. Others were not tried.
EEVEE_READS_VERTEX_GROUPS = bpy.app.version >= (5, 2, 0)
# Whether EEVEE computes what depends on constants alone before it writes a shader. Only 4.5 and 5.2 were tried.
EEVEE_EVALUATES_CONSTANTS = bpy.app.version >= (5, 2, 0)


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


def has_window() -> bool:
    """Whether Blender has windows. Only then do timers run and panels draw."""
    return not bpy.app.background


def in_window() -> AbstractContextManager[object]:
    """The context of a window of the open file, in which Blender runs scripts too. Once a file is open, a command has
    none, and without one operators and members such as `active_object` are missing."""
    context = bpy.context
    of_scene = (window for window in context.window_manager.windows if window.scene == context.scene)
    return context.temp_override(window=context.window or next(of_scene, None))


def redraw_views() -> None:
    """Redraw the 3D views of all windows, with their sidebars."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def is_rendering() -> bool:
    """Whether a render or a texture bake is running in a background thread."""
    running: Any = bpy.app.is_job_running  # the stubs say it returns None
    return bool(running("RENDER") or running("OBJECT_BAKE"))


# Seconds without a change after which a drag counts as paused or ended.
STILL = 0.2
_count, _last = 0, 0.0


def note_change() -> None:
    """Note a change; called by Blender's handlers."""
    global _count, _last
    _count, _last = _count + 1, time.monotonic()


def change_count() -> int:
    """The number of changes that Blender reported. A result is up to date while this number stays the same."""
    return _count


def seconds_until_still() -> float:
    """Seconds until nothing has changed for STILL seconds; 0 if that is already so."""
    return max(0.0, _last + STILL - time.monotonic())
