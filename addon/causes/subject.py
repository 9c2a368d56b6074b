# SPDX-License-Identifier: GPL-3.0-or-later
"""What the checks look at: a grating and the objects of a scene that show it."""

from dataclasses import dataclass

import bpy

from ..gratings.grating import Grating
from ..materials.group_properties import is_diffraction, lights_of
from ..materials.group_users import shown_by
from ..materials.material import diffraction_nodes


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
        """Which lights the group shows (gratings/lights_choice.py)."""
        return lights_of(self.group)


def subject_of(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> Subject | None:
    """The scene's active grating with the meshes that have it; None if no mesh of the scene has it."""
    grating = scene.natural_gratings.active()
    if grating is None or not is_diffraction(grating.group):
        return None
    things = [each for each in shown_by(grating.group) if each.type == "MESH" and scene in each.users_scene]
    return Subject(scene, layer, grating, grating.group, things) if things else None
