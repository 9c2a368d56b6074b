# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage on which the sample snake is rendered: dark ground, one sun or a clear sky, camera.

python -m sample_scenes.stage --output snake.blend [--sun-azimuth-deg 52 --sun-elevation-deg 30] [--sky]
blender --background --python sample_scenes/stage.py -- --output snake.blend"""

from __future__ import annotations

import sys
from math import cos, radians, sin
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

if not __package__:  # `blender --python` runs this file as a script
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    __package__ = "sample_scenes"
from precompute.cli.arguments import number
from precompute.cli.parser import OneLineParser
from precompute.mesh.shapes import Shape

from .snake import build_snake, plain_material

# Sun and camera almost face each other across the snake's long straight runs. On most runs the first order of a grating
# of 1144 nm along the body meets the camera. From azimuth 52 the colours run in the other direction.
SUN_AZIMUTH_DEG = 128.0
SUN_ELEVATION_DEG = 30.0
SUN_STRENGTH = 12.0
SUN_ANGLE_DEG = 0.53
# Relative to the Sky Texture's own radiance: the ground is as bright as under the lamp.
SKY_STRENGTH = 0.15
CAMERA_LOCATION_M = (-0.036, -0.80, 0.69)
CAMERA_TARGET_M = (-0.036, -0.025, 0.02)
CAMERA_LENS_MM = 74.0


def clean_scene() -> None:
    """Remove all objects and their data. Loading the factory settings instead would disable extensions."""
    data = bpy.data
    for collection in (data.objects, data.meshes, data.lights, data.cameras, data.materials):
        data.batch_remove(list(collection))


def add_object(scene: bpy.types.Scene, name: str, data: bpy.types.ID) -> bpy.types.Object:
    new = bpy.data.objects.new(name, data)
    scene.collection.objects.link(new)
    return new


def add_surface(
    scene: bpy.types.Scene, name: str, points: np.ndarray, *, faces: np.ndarray, material: bpy.types.Material
) -> bpy.types.Object:
    """An object of points (n, 3) and faces (m, corners)."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(points).tolist(), [], np.asarray(faces).tolist())
    mesh.materials.append(material)
    return add_object(scene, name, mesh)


def add_plane(
    scene: bpy.types.Scene, name: str, half_m: float, material: bpy.types.Material, *, z: float = 0.0
) -> bpy.types.Object:
    """A level square about the z axis."""
    points = [(x * half_m, y * half_m, z) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return add_surface(scene, name, points, faces=[(0, 1, 2, 3)], material=material)


def paint(mesh: bpy.types.Mesh, name: str, colours: np.ndarray, *, domain: str) -> None:
    """Give a mesh linear colours (n, 3), one for each POINT or CORNER."""
    layer = mesh.color_attributes.new(name, "FLOAT_COLOR", domain)
    layer.data.foreach_set("color", np.column_stack([colours, np.ones(len(colours))]).astype(np.float32).ravel())


def new_mesh(name: str, shape: Shape) -> bpy.types.Mesh:
    """A flat-shaded mesh of a shape."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(shape.points.tolist(), [], shape.quads.tolist())
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", shape.uv.astype(np.float32).ravel())
    return mesh


def add_ground(scene: bpy.types.Scene, half_size_m: float = 4.0) -> bpy.types.Object:
    """A dark, matt plane at z = 0 that fills the view."""
    return add_plane(scene, "Ground", half_size_m, plain_material("Ground", (0.012, 0.012, 0.0125), roughness=1.0))


def add_sun(scene: bpy.types.Scene, azimuth_deg: float, elevation_deg: float) -> bpy.types.Object:
    """A sun lamp. Azimuth is counter-clockwise from +X seen from above, elevation is from the floor."""
    azimuth, elevation = radians(azimuth_deg), radians(elevation_deg)
    to_sun = Vector((cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation)))
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy = SUN_STRENGTH
    light.angle = radians(SUN_ANGLE_DEG)
    sun = add_object(scene, "Sun", light)
    sun.location = to_sun
    sun.rotation_euler = to_sun.to_track_quat("Z", "Y").to_euler()
    return sun


def add_camera(scene: bpy.types.Scene) -> bpy.types.Object:
    data = bpy.data.cameras.new("Camera")
    data.lens = CAMERA_LENS_MM
    data.clip_start = 0.01
    camera = add_object(scene, "Camera", data)
    camera.location = CAMERA_LOCATION_M
    away = Vector(CAMERA_LOCATION_M) - Vector(CAMERA_TARGET_M)
    camera.rotation_euler = away.to_track_quat("Z", "Y").to_euler()
    scene.camera = camera
    return camera


def new_world(scene: bpy.types.Scene, name: str) -> bpy.types.Node:
    """Give a scene a new world and return its Background node."""
    scene.world = bpy.data.worlds.new(name)
    if bpy.app.version < (5, 0):
        scene.world.use_nodes = True
    return scene.world.node_tree.nodes["Background"]


def surround_by(scene: bpy.types.Scene, name: str, panorama: bpy.types.Image) -> None:
    """Give a scene a new world that shows a panorama."""
    background = new_world(scene, name)
    texture = scene.world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = panorama
    scene.world.node_tree.links.new(texture.outputs["Color"], background.inputs["Color"])


def dim_world(scene: bpy.types.Scene) -> None:
    """A dim grey world that keeps the unlit skin visible."""
    background = new_world(scene, "Dim")
    background.inputs["Color"].default_value = (0.9, 0.95, 1.0, 1)
    background.inputs["Strength"].default_value = 0.12


def light_by_sky(scene: bpy.types.Scene, azimuth_deg: float, elevation_deg: float) -> None:
    """Replace sun lamp and world by a clear sky whose sun is in the lamp's place."""
    background = new_world(scene, "Sky")
    sky = scene.world.node_tree.nodes.new("ShaderNodeTexSky")
    # The azimuth of a Sky Texture's sun is clockwise from +Y.
    sky.sun_rotation, sky.sun_elevation = radians(90 - azimuth_deg), radians(elevation_deg)
    scene.world.node_tree.links.new(sky.outputs[0], background.inputs["Color"])
    background.inputs["Strength"].default_value = SKY_STRENGTH


def render_settings(scene: bpy.types.Scene) -> None:
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = 960, 540
    scene.render.resolution_percentage = 100
    scene.cycles.device = "CPU"
    scene.cycles.samples = 64
    scene.cycles.use_denoising = True
    scene.cycles.max_bounces = 4
    # AgX would wash the spectral colours out.
    scene.view_settings.view_transform = "Standard"


def build_stage(
    scene: bpy.types.Scene,
    sun_azimuth_deg: float = SUN_AZIMUTH_DEG,
    sun_elevation_deg: float = SUN_ELEVATION_DEG,
    *,
    sky: bool = False,
) -> None:
    """Add ground, light and camera to `scene`, and set it up for Cycles on the CPU."""
    add_ground(scene)
    add_camera(scene)
    if sky:
        light_by_sky(scene, sun_azimuth_deg, sun_elevation_deg)
    else:
        add_sun(scene, sun_azimuth_deg, sun_elevation_deg)
        dim_world(scene)
    render_settings(scene)


def main(argv: list[str]) -> None:
    parser = OneLineParser(prog="sample_scenes.stage", description="Write the sample snake scene.")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.blend")
    parser.add_argument("--sun-azimuth-deg", type=number(-360, 360), default=SUN_AZIMUTH_DEG)
    parser.add_argument("--sun-elevation-deg", type=number(-90, 90), default=SUN_ELEVATION_DEG)
    parser.add_argument("--sky", action="store_true", help="a clear sky in place of the sun lamp")
    args = parser.parse_args(argv)
    clean_scene()
    build_snake()
    build_stage(bpy.context.scene, args.sun_azimuth_deg, args.sun_elevation_deg, sky=args.sky)
    bpy.ops.wm.save_as_mainfile(filepath=str(args.output.resolve()))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])
