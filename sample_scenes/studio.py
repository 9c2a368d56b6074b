# SPDX-License-Identifier: GPL-3.0-or-later
"""A photographer's studio for small objects: a floor, a key, a fill and a rim lamp, a camera.

The lamps are the fewest that show a grating. The key has a small angular size, so its diffraction orders are coloured
and not white. Fill and rim are wide and show the shape."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, radians, sin

import bpy
from mathutils import Vector

from .stage import add_object, add_plane, new_world, plain_material, render_settings

# Keeps white, and the hue of saturated light: Standard would clip it, AgX would desaturate it.
VIEW_TRANSFORM = "Khronos PBR Neutral"


@dataclass(frozen=True)
class Towards:
    """Position of a lamp or the camera relative to its target: azimuth counter-clockwise from +X and elevation from the
    floor, in degrees, and distance in metres."""

    azimuth_deg: float
    elevation_deg: float
    distance_m: float

    def place(self, target: tuple[float, float, float]) -> Vector:
        azimuth, elevation = radians(self.azimuth_deg), radians(self.elevation_deg)
        flat = cos(elevation)
        away = Vector((flat * cos(azimuth), flat * sin(azimuth), sin(elevation)))
        return Vector(target) + away * self.distance_m


def face(thing: bpy.types.Object, at: Towards, target: tuple[float, float, float]) -> None:
    """Place a lamp or a camera and turn it to the target."""
    thing.location = at.place(target)
    thing.rotation_euler = (thing.location - Vector(target)).to_track_quat("Z", "Y").to_euler()


def add_floor(
    scene: bpy.types.Scene, colour: tuple[float, float, float], *, half_m: float = 6.0, roughness: float = 0.8
) -> bpy.types.Object:
    """A flat floor. There is no back wall, because it would block the lamps behind the scene."""
    return add_plane(scene, "Floor", half_m, plain_material("Floor", colour, roughness))


def add_softbox(
    scene: bpy.types.Scene, name: str, at: Towards, *, target: tuple[float, float, float], size_m: float, power_w: float
) -> bpy.types.Object:
    """A square area lamp that faces the target."""
    light = bpy.data.lights.new(name, "AREA")
    light.shape, light.size, light.energy = "SQUARE", size_m, power_w
    lamp = add_object(scene, name, light)
    face(lamp, at, target)
    return lamp


def add_key(
    scene: bpy.types.Scene,
    name: str,
    at: Towards,
    *,
    target: tuple[float, float, float],
    strength: float,
    angle_deg: float,
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> bpy.types.Object:
    """A sun lamp with the angular size `angle_deg`, so distant that every scale sees it in one direction."""
    light = bpy.data.lights.new(name, "SUN")
    light.energy, light.angle, light.color = strength, radians(angle_deg), colour
    lamp = add_object(scene, name, light)
    face(lamp, at, target)
    return lamp


def add_camera(
    scene: bpy.types.Scene, at: Towards, target: tuple[float, float, float], lens_mm: float
) -> bpy.types.Object:
    """The scene's camera."""
    data = bpy.data.cameras.new("Camera")
    data.lens, data.clip_start = lens_mm, 0.005
    camera = add_object(scene, "Camera", data)
    face(camera, at, target)
    scene.camera = camera
    return camera


def wrap_in_dusk(scene: bpy.types.Scene, radiance: float, *, low: float = 0.25) -> float:
    """A world without bright spots that falls from the zenith to the share `low` at the horizon, so reflections are not
    black. Returns the irradiance of level ground in W/m2."""
    background = new_world(scene, "Dusk")
    nodes, links = scene.world.node_tree.nodes, scene.world.node_tree.links
    where, split, ramp = (
        nodes.new("ShaderNodeTexCoord"),
        nodes.new("ShaderNodeSeparateXYZ"),
        nodes.new("ShaderNodeMapRange"),
    )
    ramp.inputs["To Min"].default_value, ramp.inputs["To Max"].default_value = low * radiance, radiance
    links.new(where.outputs["Generated"], split.inputs[0])
    links.new(split.outputs["Z"], ramp.inputs["Value"])
    links.new(ramp.outputs["Result"], background.inputs["Strength"])
    background.inputs["Color"].default_value = (1.0, 0.97, 0.93, 1.0)
    return pi * radiance * (2 + low) / 3


def settings(scene: bpy.types.Scene, samples: int = 64) -> None:
    """Set up Cycles on the CPU with its denoiser, and a view transform that keeps spectral colours."""
    render_settings(scene)
    scene.cycles.samples = samples
    scene.cycles.max_bounces = 6
    scene.view_settings.view_transform = VIEW_TRANSFORM
