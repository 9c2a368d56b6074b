# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a scene that tests change, put back before the next test, and a world that takes little time."""

import bpy


def put_back(addon, scene: bpy.types.Scene) -> None:
    """Put the render's settings back as in a new file, and remove the light groups of the active view layer."""
    for name in ("film_transparent", "resolution_percentage"):
        scene.render.property_unset(name)
    addon.compat.write_pictures(scene.render.image_settings, "PNG")
    for _ in list(bpy.context.view_layer.lightgroups):
        bpy.ops.scene.view_layer_remove_lightgroup()


def dark_world() -> bpy.types.World:
    """A new black world with a small reflection probe. EEVEE makes a probe of 2048 x 2048 without a world too, which
    takes a second a picture without a graphics card."""
    dark = bpy.data.worlds.new("Dark")
    dark.color, dark.probe_resolution = (0, 0, 0), "128"
    if dark.node_tree:
        dark.node_tree.nodes.clear()
    return dark
