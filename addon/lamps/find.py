# SPDX-License-Identifier: GPL-3.0-or-later
"""The lamps of a scene: which of them light diffraction, and which of their features it does not follow."""

import math

import bpy

from ..scene import compat

# Every lamp costs time in every pixel, so only the brightest are followed.
LAMPS_MAX = 8
# A custom property of a lamp's data, also in saved files: it is a Diffraction Lamp, which sends diffracted light
# (materials/fan.py).
FAN = "ng_fan"


def lamps_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """All lamps of the scene, also those that are hidden now: they may be shown later. Diffraction Lamps are none."""
    return [o for o in scene.collection.all_objects if o.type == "LIGHT" and not is_fan(o)]


def is_fan(lamp: bpy.types.Object) -> bool:
    """Whether a lamp is a Diffraction Lamp. Its light was counted where it was diffracted."""
    return FAN in lamp.data


def brightest(lamps: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """The lamps that count, at most LAMPS_MAX of them: suns first, then by strength, then by name."""
    return sorted(lamps, key=lambda o: (o.data.type != "SUN", -o.data.energy, o.name))[:LAMPS_MAX]


def instanced_lamps(depsgraph: bpy.types.Depsgraph) -> list[str]:
    """Names of the lamps that instances of collections or particles show.

    Such a lamp is one object at many places, and no driver can follow all of them."""
    instances = [i.object.original for i in depsgraph.object_instances if i.is_instance and i.object.type == "LIGHT"]
    return sorted({lamp.name for lamp in instances if not is_fan(lamp)})


def instances_are_not_followed(names: list[str]) -> str:
    """The message that names instanced lamps and their remedy."""
    return f"instanced lamps do not light diffraction: {', '.join(names)}; use Object > Apply > Make Instances Real"


def unfollowed_features(scene: bpy.types.Scene) -> list[str]:
    """One line for each feature of the lamps that diffraction does not follow."""
    lamps = lamps_of(scene)
    lines = []
    counted = brightest(lamps)
    left_out = sorted(lamp.name for lamp in lamps if lamp not in counted)
    if left_out:
        names = ", ".join(left_out)
        lines.append(f"only {LAMPS_MAX} lamps light diffraction, hidden ones among them; left out: {names}")
    for lamp in lamps:
        if _has_own_nodes(lamp.data):
            lines.append(f"{lamp.name}: its shader nodes are not followed")
        if lamp.data.type == "AREA" and lamp.data.spread < math.pi - 1e-3:
            lines.append(f"{lamp.name}: its spread is not followed")
    return lines


def _has_own_nodes(lamp: bpy.types.Light) -> bool:
    """Whether the lamp's nodes are more than the white emission of strength 1 that every lamp has."""
    tree = compat.lamp_nodes(lamp)
    nodes = tree.nodes if tree is not None else ()
    return not all(n.type == "OUTPUT_LIGHT" or _is_plain_emission(n) for n in nodes)


def _is_plain_emission(node: bpy.types.Node) -> bool:
    if node.type != "EMISSION":
        return False
    colour, strength = node.inputs["Color"], node.inputs["Strength"]
    is_white = tuple(colour.default_value) == (1, 1, 1, 1) and strength.default_value == 1
    return is_white and not colour.is_linked and not strength.is_linked
