# SPDX-License-Identifier: GPL-3.0-or-later
"""The sets on which the animal is shown: soil with bark, soil with a shed skin, a terrarium's corner, a grey plate."""

from __future__ import annotations

from math import radians

import bpy
import numpy as np

from .bark import Placed, add_bark
from .lookdev import add_plate
from .noise import fractal_noise
from .soil import add_soil
from .terrarium import CORNER, add_corner

_SHED_MM, _SHED_FACES = 75.0, 40_000
_SHED_OVER_FLOOR_M, _CURL_RADIUS_M = 0.0055, 0.02


def add_set(scene: bpy.types.Scene, name: str, snake: bpy.types.Object, species: str) -> None:
    """Add the set of this name around a snake of this species that lies on the floor z = 0."""
    SETS[name](scene, snake, species)


def _soil(scene: bpy.types.Scene, snake: bpy.types.Object, _: str) -> None:
    add_soil(scene, [snake, add_bark(scene)])


def _shed(scene: bpy.types.Scene, snake: bpy.types.Object, species: str) -> None:
    add_soil(scene, [snake, _add_shed(species, (0.015, -0.118), -14.0)])


def _terrarium(scene: bpy.types.Scene, snake: bpy.types.Object, species: str) -> None:
    bark = add_bark(scene, Placed(0.17, 0.125, -6.0, sunk_m=0.012))
    add_soil(scene, [snake, bark, _add_shed(species, (-0.06, -0.13), 20.0)], walls=CORNER)
    add_corner(scene)


def _plate(scene: bpy.types.Scene, *_: object) -> None:
    add_plate(scene)


# Stops by which a picture of the set is exposed less, because the set is brighter than soil.
STOPS_LESS = {"turntable": 2.0}
SETS = {"soil": _soil, "shed": _shed, "terrarium": _terrarium, "turntable": _plate}


def _add_shed(species: str, place: tuple[float, float], turn_deg: float) -> bpy.types.Object:
    """A piece of shed skin, curled up at its sides and crumpled, a little over the soil."""
    bpy.ops.grating.add_shed_skin(species=species, size_mm=_SHED_MM, faces=_SHED_FACES)
    shed = bpy.context.object
    points = np.empty(3 * len(shed.data.vertices), np.float32)
    shed.data.vertices.foreach_get("co", points)
    points = points.reshape(-1, 3).astype(float)
    x, y, z = points.T
    # The sides curl up in arcs that begin a third from the middle.
    flat = _SHED_MM * 1e-3 / 6
    turned = np.maximum(np.abs(y) - flat, 0) / (_CURL_RADIUS_M * (1 + 0.25 * fractal_noise(x[:, None] / 0.03, 2, 1)))
    crumple = 0.005 * fractal_noise(points[:, :2] / (0.03, 0.014), 3, 2)
    radius = _CURL_RADIUS_M - z - crumple
    across = np.sign(y) * (np.minimum(np.abs(y), flat) + radius * np.sin(turned))
    bent = np.stack([x, across, _CURL_RADIUS_M - radius * np.cos(turned)], axis=1)
    shed.data.vertices.foreach_set("co", bent.astype(np.float32).ravel())
    shed.data.update()
    shed.location = (*place, _SHED_OVER_FLOOR_M - bent[:, 2].min())
    shed.rotation_euler.z = radians(turn_deg)
    return shed
