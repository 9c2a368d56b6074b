# SPDX-License-Identifier: GPL-3.0-or-later
"""What hides an object: its own icons, its collections, or what rays see of it."""

from collections.abc import Iterator

import bpy

from ..blender.window import has_window


def hidden_by(thing: bpy.types.Object, layer: bpy.types.ViewLayer) -> str:
    """What hides an object from the view layer's renders or, while a window is open, from its 3D views; else empty."""
    ways = [way for way in _ways(layer.layer_collection, ()) if thing.name in way[-1].collection.objects]
    if thing.hide_render:
        return "is hidden in renders"
    if ways and all(any(held.exclude for held in way) for way in ways):
        return "is in a collection that the view layer excludes"
    if ways and all(any(held.exclude or held.collection.hide_render for held in way) for way in ways):
        return "is in a collection that is hidden in renders"
    if has_window() and not thing.visible_get(view_layer=layer):
        return "is hidden in the 3D view"
    return ""


def show(thing: bpy.types.Object, layer: bpy.types.ViewLayer) -> None:
    """Show an object in renders and in 3D views."""
    thing.hide_render = thing.hide_viewport = False
    ways = [way for way in _ways(layer.layer_collection, ()) if thing.name in way[-1].collection.objects]
    for held in ways[0] if ways else ():
        # A view layer's first collection, the scene's own, cannot be excluded.
        if held != layer.layer_collection:
            held.exclude = held.hide_viewport = False
        if held.collection.hide_render or held.collection.hide_viewport:
            held.collection.hide_render = held.collection.hide_viewport = False
    layer.update()
    if thing.name in layer.objects:
        thing.hide_set(False, view_layer=layer)


def _ways(
    held: bpy.types.LayerCollection, above: tuple[bpy.types.LayerCollection, ...]
) -> Iterator[tuple[bpy.types.LayerCollection, ...]]:
    """The chains of nested collections from the view layer's first collection to each of its collections."""
    way = (*above, held)
    yield way
    for child in held.children:
        yield from _ways(child, way)
