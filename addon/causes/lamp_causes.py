# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks whether anything lights the grating."""

from collections.abc import Iterator

import bpy

from ..blender import compat
from ..gratings.lights_choice import ALL, LAMPS_ONLY
from ..lamps.find import instanced_lamps, instances_are_not_followed, is_left_out, lamps_of
from ..lamps.light_linking import receives
from ..lamps.sky import source_count
from ..lamps.strength import irradiances
from ..materials.group_users import listed
from ..materials.skin import answers_to_world
from ..worlds.world_light import world_light
from .cause import Cause, light_button, mend
from .shown_things import hidden_by
from .subject import Subject

# Nodes that give a world colours that differ from direction to direction.
_UNEVEN = {"TEX_ENVIRONMENT", "TEX_SKY", "TEX_IMAGE", "TEX_COORD", "NEW_GEOMETRY"}


def dark_lamps(subject: Subject) -> Iterator[Cause]:
    """No lamp, or none that is on, and nothing else that gives colours."""
    lamps = lamps_of(subject.scene)
    dark = {lamp: why for lamp in lamps if (why := why_dark(lamp, subject))}
    if len(dark) < len(lamps) or source_count(subject.scene) > 0 or has_other_light(subject):
        return
    if lamps:
        reasons = "; ".join(f"{lamp.name} {why}" for lamp, why in list(dark.items())[:3])
        told = f"No lamp lights {listed(subject.things)}: {reasons}."
        yield Cause("DARK_LAMPS", told, mend("SHOW_LAMPS", "Show the Lamps"))
        return
    instanced = instanced_lamps(subject.layer.depsgraph)
    if instanced:
        line = instances_are_not_followed(instanced)
        yield Cause("INSTANCED", f"{line[0].upper()}{line[1:]}.", light_button())
        return
    yield Cause("NO_LAMP", f"The scene has no lamp, {_without_lamps(subject)}.", light_button())


def why_dark(lamp: bpy.types.Object, subject: Subject) -> str:
    """Why a lamp lights none of the objects; empty if it lights one."""
    hidden = hidden_by(lamp, subject.layer)
    if hidden:
        return hidden
    if is_left_out(lamp) and subject.lit_by != ALL:
        return "is left out of the diffraction"
    if not lamp.visible_glossy:
        return "is hidden from glossy rays (Object > Visibility > Ray Visibility)"
    if lamp.data.energy == 0:
        return "has no power"
    if max(lamp.data.color) <= 0:
        return "is black"
    if not irradiances([lamp], ())[0] > 0:
        return "is so small or weak that it gives no light"
    receivers = lamp.light_linking.receiver_collection
    if receivers is not None and not any(receives(receivers, thing) for thing in subject.things):
        return "is kept away by Light Linking"
    return ""


def _without_lamps(subject: Subject) -> str:
    if _lights_alone(subject):
        return "and with Lamps Only nothing else lights the diffraction, so it is black"
    return "and an even world shows no colours" if world_light(subject.scene.world) > 0 else "and its world is black"


def has_other_light(subject: Subject) -> bool:
    """Whether something may show colours that is neither a lamp nor a source of the world: an uneven world without
    sources, or an object that shines."""
    if _lights_alone(subject):
        return False
    scene = subject.scene
    is_uneven = world_light(scene.world) > 0 and _is_uneven(scene.world) and source_count(scene) == 0
    return is_uneven or any(_shines(each) for each in _other_materials(subject))


def _lights_alone(subject: Subject) -> bool:
    return subject.lit_by == LAMPS_ONLY or not answers_to_world(subject.group)


def _is_uneven(world: bpy.types.World) -> bool:
    """Whether a world's light may differ from direction to direction."""
    tree = compat.world_nodes(world)
    return tree is not None and any(node.type in _UNEVEN or node.type == "GROUP" for node in tree.nodes)


def _other_materials(subject: Subject) -> set[bpy.types.Material]:
    """The materials of the scene's other objects."""
    others = set(subject.scene.objects) - set(subject.things)
    return {slot.material for thing in others for slot in thing.material_slots if slot.material is not None}


def _shines(material: bpy.types.Material) -> bool:
    """Whether a material has nodes that give light."""
    for node in material.node_tree.nodes if material.node_tree is not None else ():
        name = {"EMISSION": "Strength", "BSDF_PRINCIPLED": "Emission Strength"}.get(node.type, "")
        if name in node.inputs and (node.inputs[name].is_linked or node.inputs[name].default_value > 0):
            return True
    return False
