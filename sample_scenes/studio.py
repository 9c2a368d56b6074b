# SPDX-License-Identifier: GPL-3.0-or-later
"""A photographer's studio for small things: a floor, a key lamp, a fill, a rim, a camera.

The lamps are the fewest that show a grating: the key is small in the sky of the thing that it lights, so that its
orders are colours and not white; fill and rim are wide, and show shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin

import bpy
from mathutils import Vector

from .snake import plain_material
from .stage import add_object, new_world, render_settings

# White keeps its place and saturated light keeps its hue: Standard would clip it, AgX would wash it out.
VIEW_TRANSFORM = "Khronos PBR Neutral"


@dataclass(frozen=True)
class Towards:
    """Where a lamp or the camera stands: azimuth counter-clockwise from +X, elevation from the floor, in degrees, and
    the distance in metres from the thing that it faces."""

    azimuth_deg: float
    elevation_deg: float
    distance_m: float

    def place(self, target: tuple[float, float, float]) -> Vector:
        azimuth, elevation = radians(self.azimuth_deg), radians(self.elevation_deg)
        flat = cos(elevation)
        away = Vector((flat * cos(azimuth), flat * sin(azimuth), sin(elevation)))
        return Vector(target) + away * self.distance_m


def face(thing: bpy.types.Object, at: Towards, target: tuple[float, float, float]) -> None:
    """Put a lamp or a camera somewhere and turn it to the target."""
    thing.location = at.place(target)
    thing.rotation_euler = (thing.location - Vector(target)).to_track_quat("Z", "Y").to_euler()


def add_floor(
    scene: bpy.types.Scene, colour: tuple[float, float, float], *, half_m: float = 6.0, roughness: float = 0.8
) -> bpy.types.Object:
    """A sheet on the floor. It ends in no wall, which would stand before the lamps behind the scene."""
    corners = [(x * half_m, y * half_m, 0.0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    mesh = bpy.data.meshes.new("Floor")
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    mesh.materials.append(plain_material("Floor", colour, roughness))
    return add_object(scene, "Floor", mesh)


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
) -> bpy.types.Object:
    """A sun: a lamp so far away that every scale sees it in one direction, `angle_deg` wide."""
    light = bpy.data.lights.new(name, "SUN")
    light.energy, light.angle = strength, radians(angle_deg)
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


def wrap_in_dusk(scene: bpy.types.Scene, radiance: float, *, low: float = 0.25) -> None:
    """A world that is brightest overhead and falls to the share `low` at the horizon: no lamp, and no black void in
    what mirrors it."""
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
    background.inputs["Color"].default_value = (0.85, 0.93, 1.0, 1.0)


def settings(scene: bpy.types.Scene, samples: int = 64) -> None:
    """Cycles on the CPU with its denoiser, and a view that keeps spectral colours."""
    render_settings(scene)
    scene.cycles.samples = samples
    scene.cycles.max_bounces = 6
    scene.view_settings.view_transform = VIEW_TRANSFORM
