# SPDX-License-Identifier: GPL-3.0-or-later
"""What polished metal has to reflect: the world, large lamps, or the cards of a light rig."""

from dataclasses import replace

import bpy
import numpy as np
from mathutils import Vector

from ....precompute.measure.best_lamp_directions import Preference
from ...gratings.grating import LAMPS_ONLY, Grating
from ...lamps.brightest_lamps import lamps_of
from ...lamps.light_rig import RigLamp, is_of_rig
from ...materials.material import shown_by
from ...worlds.world_light import world_light
from .rig_places import Lit

# The radiance from which on an even world shows a metal's colour.
_BRIGHT = 0.25
# The side of a lamp over its distance from which on it is seen as a surface.
_LARGE = 0.5
# The side of a card over its distance, so wide that the table leaves its light to closures (materials/lamp_choice.py);
# and its irradiance over the key's, also of one that fills all that the viewer sees, where it washes colours out.
_SIDE, _SHARE, _FILLING = 2.0, 0.4, 0.1
_NAMES = "Card", "Second Card"
# At most this many directions are tried for a card.
_TRIED = 200


def dull(scene: bpy.types.Scene, grating: Grating) -> list[str]:
    """A warning if a grating of metal or films has little to reflect where it is shown."""
    if grating.matter == "DIELECTRIC" or grating.lit_by == LAMPS_ONLY or any(map(is_of_rig, scene.objects)):
        return []
    shown = [thing for thing in shown_by(grating.group) if scene.objects.get(thing.name) == thing]
    if not any(lacks_reflections(scene, thing.matrix_world.translation) for thing in shown):
        return []
    return [f"{grating.name}: it has little to reflect in this dim world, so it looks dark; press Light Rig"]


def lacks_reflections(scene: bpy.types.Scene, middle: Vector) -> bool:
    """Whether a metal in `middle` has little to reflect: a dim, even world, and no large lamp besides a light rig's."""
    own = [lamp for lamp in lamps_of(scene) if not is_of_rig(lamp)]
    return world_light(scene.world) < _BRIGHT and not any(_is_large(lamp, middle) for lamp in own)


def _is_large(lamp: bpy.types.Object, middle: Vector) -> bool:
    away = (lamp.matrix_world.translation - middle).length
    is_shown = lamp.data.type == "AREA" and not lamp.hide_render
    return is_shown and lamp.data.size * max(lamp.matrix_world.to_scale()) >= _LARGE * away


def cards(lit: Lit, key: RigLamp, prefer: Preference) -> list[RigLamp]:
    """Up to two large dim lamps, apart from each other, where the most of these places mirror them to the viewer, for a
    key's irradiance."""
    normals = np.concatenate([each.frames[:, 2] for each in lit.places])
    to_view = np.concatenate([each.to_view for each in lit.places])
    mirrored = 2 * (normals * to_view).sum(axis=1, keepdims=True) * normals - to_view
    tried = mirrored[:: max(1, len(mirrored) // _TRIED)]
    shown_in = tried @ mirrored.T > np.cos(np.arctan(_SIDE / 2))
    weights, empty = prefer(tried), np.ones(len(mirrored))
    towards: list[np.ndarray] = []
    while len(towards) < len(_NAMES) and empty.any():
        best = int(np.argmax(shown_in @ empty * weights))
        empty, weights = empty * ~shown_in[best], weights * (1 - tried @ tried[best])
        towards.append(tried[best])
    irradiance = key.irradiance * (_SHARE if len(towards) > 1 else _FILLING)
    card = RigLamp("", "AREA", (_SIDE, _SIDE), key.to, irradiance, key.distance, is_card=True)
    return [replace(card, name=name, to=to) for name, to in zip(_NAMES, towards, strict=False)]
