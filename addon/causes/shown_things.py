# SPDX-License-Identifier: GPL-3.0-or-later
"""What hides an object: its own icons, its collections, or what rays see of it."""

from collections.abc import Iterator

import bpy

from ..blender.window import has_window


def hidden_by(thing: bpy.types.Object, layer: bpy.types.ViewLayer) -> str:
    """What hides an object from the view layer's renders or, while a window is open, from its 3D views; else empty."""
    ways = _ways_to(thing, layer)
    if thing.hide_render:
        return "is hidden in renders"
    if ways and all(any(held.exclude for held in way) for way in ways):
        return "is in a collection that the view layer excludes"
    if ways and all(any(held.exclude or held.collection.hide_render for held in way) for way in ways):
        return "is in a collection that is hidden in renders"
    if has_window() and not thing.visible_get(view_layer=layer):
        return "is hidden in the 3D view"
    return ""


def held_out(thing: bpy.types.Object, layer: bpy.types.ViewLayer) -> str:
    """What makes the view layer show an object as a hole, or only to other objects; else empty."""
    if thing.holdout_get(view_layer=layer):
        return "is a holdout" if thing.is_holdout else "is in a collection that the view layer holds out"
    return "is in a collection of Indirect Only" if thing.indirect_only_get(view_layer=layer) else ""


def end_holdout(thing: bpy.types.Object, layer: bpy.types.ViewLayer) -> None:
    """Show an object as a surface in the view layer."""
    thing.is_holdout = False
    for *_, held in _ways_to(thing, layer):
        held.holdout = held.indirect_only = False


def show(thing: bpy.types.Object, layer: bpy.types.ViewLayer) -> None:
    """Show an object in renders and in 3D views."""
    thing.hide_render = thing.hide_viewport = False
    ways = _ways_to(thing, layer)
    for held in ways[0] if ways else ():
        # A view layer's first collection, the scene's own, cannot be excluded.
        if held != layer.layer_collection:
            held.exclude = held.hide_viewport = False
        if held.collection.hide_render or held.collection.hide_viewport:
            held.collection.hide_render = held.collection.hide_viewport = False
    layer.update()
    if thing.name in layer.objects:
        thing.hide_set(False, view_layer=layer)


def _ways_to(thing: bpy.types.Object, layer: bpy.types.ViewLayer) -> list[tuple[bpy.types.LayerCollection, ...]]:
    """The chains of nested collections to each collection that holds an object."""
    return [way for way in _ways(layer.layer_collection, ()) if thing.name in way[-1].collection.objects]


def _ways(
    held: bpy.types.LayerCollection, above: tuple[bpy.types.LayerCollection, ...]
) -> Iterator[tuple[bpy.types.LayerCollection, ...]]:
    """The chains of nested collections from the view layer's first collection to each of its collections."""
    way = (*above, held)
    yield way
    for child in held.children:
        yield from _ways(child, way)
