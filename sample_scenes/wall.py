# SPDX-License-Identifier: GPL-3.0-or-later
"""A grating on a table before a white wall, under a narrow spot, to throw its spectrum onto the wall.

python -m sample_scenes.wall --output wall.blend
blender --background --python sample_scenes/wall.py -- --output wall.blend

The grooves run towards the wall, so the diffraction orders lie side by side on it. `grating assign BAKE --object
Carrier --lights lamps`, then `grating diffraction-lamp --object Carrier` add the spectrum."""

from __future__ import annotations

import sys
from math import radians
from pathlib import Path

import bpy
from mathutils import Vector

if not __package__:  # `blender --python` runs this file as a script
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    __package__ = "sample_scenes"
from precompute.cli.parser import OneLineParser

from .stage import add_object, clean_scene, new_world, plain_material, render_settings

# The grating is at the origin, the wall and the spot on opposite sides along y. The spot's light comes at 45 degrees,
# so the mirror image is as high on the wall as the wall is far away.
WALL_M = 0.30
SPOT_LOCATION_M = (0.0, -0.5, 0.5)
SPOT_CONE_DEG = 1.0
SPOT_POWER_W = 2e4
CARRIER_M, CARRIER_HEIGHT_M = 0.03, 0.001
CAMERA_LOCATION_M = (0.12, -0.75, 0.36)
CAMERA_TARGET_M = (0.0, 0.2, 0.13)
CAMERA_LENS_MM = 37.0
WORLD = 0.04


def add_plane(
    scene: bpy.types.Scene, name: str, corners: list[tuple[float, float, float]], material: bpy.types.Material | None
) -> bpy.types.Object:
    """A rectangle from its corners, the first edge along U."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new(name="UVMap")
    for loop, uv in zip(layer.data, ((0, 0), (1, 0), (1, 1), (0, 1)), strict=True):
        loop.uv = uv
    if material is not None:
        mesh.materials.append(material)
    return add_object(scene, name, mesh)


def add_spot(scene: bpy.types.Scene) -> bpy.types.Object:
    """A spot that lights only the middle of the grating."""
    light = bpy.data.lights.new("Spot", "SPOT")
    light.energy, light.shadow_soft_size = SPOT_POWER_W, 0.0
    light.spot_size, light.spot_blend = radians(SPOT_CONE_DEG), 0.1
    spot = add_object(scene, "Spot", light)
    spot.location = SPOT_LOCATION_M
    spot.rotation_euler = Vector(SPOT_LOCATION_M).to_track_quat("Z", "Y").to_euler()
    return spot


def build_wall(scene: bpy.types.Scene) -> None:
    """Add table, wall, grating, spot and camera."""
    table, wall = (plain_material(name, 3 * (grey,), roughness=1.0) for name, grey in (("Table", 0.05), ("Wall", 0.8)))
    x, z = 0.6, 0.6
    add_plane(scene, "Table", [(-x, -1, 0), (x, -1, 0), (x, WALL_M, 0), (-x, WALL_M, 0)], table)
    add_plane(scene, "Wall", [(-x, WALL_M, 0), (x, WALL_M, 0), (x, WALL_M, z), (-x, WALL_M, z)], wall)
    h, above = CARRIER_M / 2, CARRIER_HEIGHT_M
    add_plane(scene, "Carrier", [(-h, -h, above), (h, -h, above), (h, h, above), (-h, h, above)], None)
    add_spot(scene)
    data = bpy.data.cameras.new("Camera")
    data.lens, data.clip_start = CAMERA_LENS_MM, 0.01
    camera = add_object(scene, "Camera", data)
    camera.location = CAMERA_LOCATION_M
    camera.rotation_euler = (camera.location - Vector(CAMERA_TARGET_M)).to_track_quat("Z", "Y").to_euler()
    scene.camera = camera
    background = new_world(scene, "Dim")
    background.inputs["Color"].default_value = (0.9, 0.95, 1.0, 1)
    background.inputs["Strength"].default_value = WORLD
    render_settings(scene)


def main(argv: list[str]) -> None:
    parser = OneLineParser(prog="sample_scenes.wall", description="Write the scene of a grating before a wall.")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.blend")
    arguments = parser.parse_args(argv)
    clean_scene()
    build_wall(bpy.context.scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(arguments.output.resolve()))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])
