# SPDX-License-Identifier: GPL-3.0-or-later
"""What the checks look at (a grating and the objects of a scene that show it), what hides an object, and a cause of
missing colours with the button that removes it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import bpy

from ..blender.session import has_window
from ..gratings.grating import Grating
from ..materials.group_properties import is_diffraction, lights_of
from ..materials.material import diffraction_nodes, shown_by


@dataclass(frozen=True)
class Subject:
    """A scene's grating with its Diffraction group, and the meshes of the scene that have it in their materials."""

    scene: bpy.types.Scene
    layer: bpy.types.ViewLayer
    grating: Grating
    group: bpy.types.NodeTree
    things: list[bpy.types.Object]

    @property
    def materials(self) -> list[bpy.types.Material]:
        """The materials of the meshes that contain the group, without duplicates."""
        slots = dict.fromkeys(slot.material for thing in self.things for slot in thing.material_slots)
        return [each for each in slots if any(node.node_tree == self.group for node in diffraction_nodes(each))]

    @property
    def nodes(self) -> list[bpy.types.Node]:
        """The nodes of these materials that hold the group."""
        return [node for each in self.materials for node in diffraction_nodes(each) if node.node_tree == self.group]

    @property
    def lit_by(self) -> str:
        """Which lights the group shows (gratings/grating.py)."""
        return lights_of(self.group)


def subject_of(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> Subject | None:
    """The scene's active grating with the meshes that have it; None if no mesh of the scene has it."""
    grating = scene.natural_gratings.active()
    if grating is None or not is_diffraction(grating.group):
        return None
    things = [each for each in shown_by(grating.group) if each.type == "MESH" and scene in each.users_scene]
    return Subject(scene, layer, grating, grating.group, things) if things else None


# Causes beside which nothing is wrong with the scene, and all that leave colours in the picture.
HARMLESS = {"DIRECTION_MAP", "CROWDED", "HELD_OUT", "LIGHT_GROUPS", "SAMPLES", "VIEW_TRANSFORM"}
_WARNINGS = {"FEW_COLOURS", "SCENE_LIGHTS", *HARMLESS}


@dataclass(frozen=True)
class Button:
    """An operator that removes a cause.

    operator    its identifier
    text        what it does, in a few words
    properties  values of its properties
    invoked     whether it is called as by a click: a bake then works in the background, and a light rig serves the view
                that the artist looks through"""

    operator: str
    text: str
    properties: Mapping[str, Any] = field(default_factory=dict)
    invoked: bool = False


@dataclass(frozen=True)
class Cause:
    """A cause of missing colours: its kind, a sentence for the artist, and a button if one can help."""

    kind: str
    sentence: str
    button: Button | None = None

    @property
    def is_warning(self) -> bool:
        """Whether it leaves colours in the picture."""
        return self.kind in _WARNINGS


def mend(action: str, text: str) -> Button:
    """The button that does an action of workflow/finding_causes.py."""
    return Button("grating.mend_cause", text, {"action": action})


def light_button() -> Button:
    """The button that lights the grating so that its colours reach the viewer."""
    return Button("grating.light_rig", "Place a Light Rig", {"kind": "SUN"}, invoked=True)


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
