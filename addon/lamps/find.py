# SPDX-License-Identifier: GPL-3.0-or-later
"""The lamps of a scene: which of them light diffraction, and which of their features it does not follow."""

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import bpy

from ..blender import compat
from .rendered_lamps import rendered

if TYPE_CHECKING:
    import numpy as np

# Finds the bounding boxes (n, 2, 3) of what the lamps light (strength.py). Called only if there are too many lamps.
LitBoxes = Callable[[bpy.types.Scene], "np.ndarray"]
# Every lamp costs time in every pixel, so only the brightest are followed.
LAMPS_MAX = 8
# So many lamps that are left out are named.
_NAMED_MAX = 8
# A lamp takes the place of a followed one if it is brighter by more than this factor. Without it, a lamp that moves to
# and fro where two are equally bright would have drivers written at each step. A factor of 1.5 is half a stop of a
# camera, or 22 % of a distance: the choice loses little light by it.
_LEAD = 1.5
# A custom property of a lamp's data, also in saved files: it is a Diffraction Lamp, which sends diffracted light
# (materials/diffraction_lamp.py).
DIFFRACTION_LAMP = "ng_fan"


def lamps_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """All lamps of the scene, also those that are hidden now: they may be shown later. Diffraction Lamps are not
    counted."""
    return [o for o in scene.collection.all_objects if o.type == "LIGHT" and not is_fan(o)]


def is_fan(lamp: bpy.types.Object) -> bool:
    """Whether a lamp is a Diffraction Lamp. Its light was counted where it was diffracted."""
    return DIFFRACTION_LAMP in lamp.data


def brightest(
    scene: bpy.types.Scene, *, followed: Sequence[bpy.types.Object] = (), lit: LitBoxes | None = None
) -> list[bpy.types.Object]:
    """The lamps that light diffraction, at most LAMPS_MAX of them, in the order of the panel's list: suns first, then
    by strength, then by name.

    If there are more lamps, those that the render shows are chosen before hidden ones, then those that send the most
    light to the boxes that `lit` finds. A lamp that is followed already gives its place only to one that is clearly
    brighter."""
    lamps = lamps_of(scene)
    if len(lamps) > LAMPS_MAX:
        lamps = _chosen(scene, lamps, set(followed), lit)
    return sorted(lamps, key=lambda o: (o.data.type != "SUN", -o.data.energy, o.name))


def _chosen(
    scene: bpy.types.Scene, lamps: list[bpy.types.Object], followed: set[bpy.types.Object], lit: LitBoxes | None
) -> list[bpy.types.Object]:
    from .strength import irradiances  # most files load no more than this

    strengths = irradiances(lamps, lit(scene) if lit is not None else ()).tolist()
    order = [
        (not shown, -strength * (_LEAD if lamp in followed else 1.0), lamp.name, index)
        for index, (lamp, shown, strength) in enumerate(zip(lamps, rendered(scene, lamps), strengths, strict=True))
    ]
    return [lamps[index] for *_, index in sorted(order)[:LAMPS_MAX]]


def instanced_lamps(depsgraph: bpy.types.Depsgraph) -> list[str]:
    """Names of the lamps that instances of collections or particles show.

    Such a lamp is one object at many places, and no driver can follow all of them."""
    if not _may_be_instanced(list(bpy.data.lights)):
        return []
    instances = [i.object.original for i in depsgraph.object_instances if i.is_instance and i.object.type == "LIGHT"]
    return sorted({lamp.name for lamp in instances if not is_fan(lamp)})


def _may_be_instanced(lights: list[bpy.types.Light]) -> bool:
    """Whether instances may show a lamp of the file: it, or a collection that holds it, is used by something that is
    neither a scene nor a collection, or a parent of it shows instances. To look through all instances takes long."""
    found: set[bpy.types.ID] = set(lights)
    pending = found
    while pending:
        users = set().union(*bpy.data.user_map(subset=pending).values()) - found
        lamps = {user for user in users if isinstance(user, bpy.types.Object) and user.type == "LIGHT"}
        holders = {user for user in users if isinstance(user, bpy.types.Collection)}
        if users - lamps - holders - set(bpy.data.scenes) or any(map(_has_instancer_above, lamps)):
            return True
        pending = lamps | holders
        found |= pending
    return False


def _has_instancer_above(thing: bpy.types.Object) -> bool:
    while (thing := thing.parent) is not None:
        if thing.is_instancer:
            return True
    return False


def instances_are_not_followed(names: list[str]) -> str:
    """The message that names instanced lamps and their remedy."""
    return f"instanced lamps do not light diffraction: {', '.join(names)}; use Object > Apply > Make Instances Real"


def unfollowed_features(scene: bpy.types.Scene, counted: Sequence[bpy.types.Object]) -> list[str]:
    """One line for each feature of the lamps that diffraction does not follow. `counted`: the lamps that light
    diffraction, of which there are LAMPS_MAX at most.

    Lamps that are left out are named if the render shows them."""
    lamps = lamps_of(scene)
    lines = []
    if len(lamps) > LAMPS_MAX:
        left_out = [lamp for lamp in lamps if lamp not in counted]
        names = sorted(lamp.name for lamp, shown in zip(left_out, rendered(scene, left_out), strict=True) if shown)
        if names:
            listed = [*names[:_NAMED_MAX], f"and {len(names) - _NAMED_MAX} more"] if len(names) > _NAMED_MAX else names
            lines.append(f"diffraction uses at most {LAMPS_MAX} lamps; left out: {', '.join(listed)}")
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
