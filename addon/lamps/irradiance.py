# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance of the scene's lamps at given points, in NumPy, without shadows. Mirrors the nodes of lamp_group.py."""

from dataclasses import dataclass

import bpy
import numpy as np

from ..blender import stored
from .brightest_lamps import LUMINANCE
from .follow import followed_lamps, has_lost_lamps, lamp_count
from .lamp_drivers import PROPERTIES, property_name
from .light_linking import is_unlinked
from .light_rig import is_card
from .sky import source_count, source_name


@dataclass(frozen=True)
class Sent:
    """The light from one lamp at n points.

    direction   (n, 3), unit vectors to the lamp
    irradiance  (n,), luminance of the irradiance on a surface facing the lamp, W/m2
    variance    (n,), of the lamp's disc as seen from the point, along one axis, rad2"""

    direction: np.ndarray
    irradiance: np.ndarray
    variance: np.ndarray


def lamps_sent(
    scene: bpy.types.Scene, thing: bpy.types.Object, places: np.ndarray, *, cards: bool = True
) -> list[Sent]:
    """The light from each followed lamp at points (n, 3) of an object, in world space, as the scene was last evaluated.
    Lamps that are dark, or that light linking excludes for the object, are left out; without `cards`, also the cards of
    a light rig."""
    found = []
    followed = [] if cards or has_lost_lamps(scene) else followed_lamps(scene)
    left_out = {index for index, lamp in enumerate(followed) if is_card(lamp)}
    for index in sorted(set(range(lamp_count(scene))) - left_out):
        held = [stored.numbers(scene, property_name(index, what), 4) for what in PROPERTIES]
        if None in held:
            continue
        packed = np.array(held)
        if (packed[1, :3] > 0).any() and not is_unlinked(thing, index):
            found.append(_from_lamp(packed, places))
    return found


def sources_sent(scene: bpy.types.Scene, places: np.ndarray) -> list[Sent]:
    """The light from each stored source of the scene's world at points (n, 3), in world space."""
    found = []
    for index in range(source_count(scene)):
        place, power = (stored.numbers(scene, source_name(index, what), 4) for what in ("place", "power"))
        if place is not None and power is not None:
            direction = np.broadcast_to(place[:3], places.shape)
            light = max(float(np.dot(power[:3], LUMINANCE)), 0.0)
            found.append(Sent(direction, np.full(len(places), light), np.full(len(places), max(-1.0 - place[3], 0.0))))
    return found


def _from_lamp(packed: np.ndarray, places: np.ndarray) -> Sent:
    """The light from a lamp with the properties (4, 4) of lamp_drivers.py."""
    (place, power, z, x), (disc, scales, rim_outer, rim_inner) = packed[:, :3], packed[:, 3]
    is_sun = disc <= -0.5
    away = np.broadcast_to(place, places.shape) if is_sun else place - places
    squared = np.maximum((away**2).sum(axis=1), 1e-18)
    direction = away / np.sqrt(squared)[:, None]
    axis = z / max(np.linalg.norm(z), 1e-30)
    y = np.cross(axis, x) * abs(scales)
    own = direction @ np.stack([x, y, z], axis=1)
    along = own[:, 2] / np.maximum(np.linalg.norm(own, axis=1), 1e-30)
    share = np.clip((along - rim_outer) / (rim_inner - rim_outer), 0, 1)
    cone = share * share * (3 - 2 * share) * np.maximum(direction @ axis, rim_outer < 1.5)
    variance = abs(disc + 1.0) if is_sun else disc
    return Sent(direction, cone * max(power @ LUMINANCE, 0.0) / squared, variance / squared)
