# SPDX-License-Identifier: GPL-3.0-or-later
"""A sun lamp in place of the sun disc of a world's Sky Texture.

EEVEE draws a Sky Texture without its disc, so there the disc lights nothing but gratings (sky.py). The lamp lights
everything, in both engines."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Vector

from ..blender import compat, stored

if TYPE_CHECKING:
    from ...precompute.world_sources.sources import Source

NAME = "Sky Sun"
# Custom property of the lamp, saved in files: marks what the next such lamp replaces.
_SKY_SUN = "ng_sky_sun"
_WITHOUT_SUN = ("PREETHAM", "HOSEK_WILKIE")


def sky_with_disc(world: bpy.types.World | None) -> bpy.types.ShaderNodeTexSky | None:
    """The first Sky Texture among the world's own nodes that is in use and shows its sun disc; else None."""
    tree = None if world is None else compat.world_nodes(world)
    skies = [node for node in (tree.nodes if tree else ()) if isinstance(node, bpy.types.ShaderNodeTexSky)]
    shown = (sky for sky in skies if sky.sun_disc and sky.sky_type not in _WITHOUT_SUN)
    return next((sky for sky in shown if any(output.is_linked for output in sky.outputs)), None)


def add_sky_sun(scene: bpy.types.Scene, sky: bpy.types.ShaderNodeTexSky, source: Source) -> bpy.types.Object:
    """Replace the disc of the scene's sky by a sun lamp with the light of the source that was fitted to it. Returns the
    lamp. It is a copy: Blender evaluates no driver anew that reads a node of a world."""
    for former in [thing for thing in scene.collection.all_objects if stored.flag(thing, _SKY_SUN)]:
        bpy.data.batch_remove([former.data, former])
    data = bpy.data.lights.new(NAME, "SUN")
    data.energy = max(float(source.irradiance.max()), 0.0)
    data.color = np.clip(source.irradiance / max(data.energy, 1e-30), 0, 1).tolist()
    # The disc of even brightness that has the source's variance (lamp_properties.py).
    data.angle = 2 * math.asin(min(2 * math.sqrt(source.variance), 1.0))
    sun = bpy.data.objects.new(NAME, data)
    sun[_SKY_SUN] = True
    scene.collection.objects.link(sun)
    sun.rotation_euler = Vector(source.direction.tolist()).to_track_quat("Z", "Y").to_euler()
    sky.sun_disc = False
    return sun
