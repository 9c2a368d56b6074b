# SPDX-License-Identifier: GPL-3.0-or-later
"""Every difference between Blender versions, 4.5 to 5.2, in one place."""

import bpy

# Whether materials have a Raycast node. In Cycles it sees every object, in EEVEE only objects on screen.
HAS_RAYCAST = bpy.app.version >= (5, 1, 0)


def working_space() -> str:
    """The file's linear working space, by precompute.colour's name. Files have a choice from Blender 5.0 on."""
    if bpy.app.version < (5, 0, 0):
        return "Rec.709"
    return bpy.data.colorspace.working_space.removeprefix("Linear ")  # type: ignore[attr-defined]  # since Blender 5.0


def eevee_engine() -> str:
    """The identifier of the EEVEE engine, which changed in Blender 5.0."""
    return "BLENDER_EEVEE" if bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT"


def write_pictures(settings: bpy.types.ImageFormatSettings, file_format: str) -> None:
    """Have renders written as single pictures of a format. From Blender 5.0 on, the formats depend on the kind of
    media, which may be video."""
    if bpy.app.version >= (5, 0, 0):
        settings.media_type = "IMAGE"  # type: ignore[attr-defined]  # since Blender 5.0
    settings.file_format = file_format  # type: ignore[assignment]  # the stubs list the names


def enable_nodes(material: bpy.types.Material | bpy.types.World | bpy.types.Light) -> None:
    """Switch the nodes of a new material, world or lamp on. From Blender 5.0 they always are, and setting them gives a
    warning."""
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True


def lamp_nodes(lamp: bpy.types.Light) -> bpy.types.NodeTree | None:
    """The nodes that make a lamp's light, if they are on. From Blender 5.0 they always are, and asking gives a
    warning."""
    return lamp.node_tree if bpy.app.version >= (5, 0, 0) or lamp.use_nodes else None


def world_nodes(world: bpy.types.World) -> bpy.types.NodeTree | None:
    """The nodes that make a world's light, if they are on. From Blender 5.0 they always are, and asking gives a
    warning."""
    return world.node_tree if bpy.app.version >= (5, 0, 0) or world.use_nodes else None


def texture_scale(scene: bpy.types.Scene) -> float:
    """The scale to which Simplify brings the pictures that Cycles reads, in the viewport or a render, the smaller of
    the two. Older versions than Blender 5.2 have no such scale."""
    names = ("texture_resolution", "texture_resolution_render")
    return min(getattr(scene.cycles, name, 1.0) for name in names)


def has_texture_cache(scene: bpy.types.Scene) -> bool:
    """Whether Cycles may read pictures of files in smaller sizes, as Blender 5.2 does."""
    return getattr(scene.render, "use_texture_cache", False)


def annotation_of(scene: bpy.types.Scene) -> bpy.types.ID | None:
    """What is drawn with the annotation tool in a scene. It is called a grease pencil before Blender 5.0."""
    return scene.annotation if bpy.app.version >= (5, 0, 0) else scene.grease_pencil  # type: ignore[attr-defined]  # since Blender 5.0
