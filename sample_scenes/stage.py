# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scenes are made of: an empty scene, objects, plain materials, worlds and the settings of Cycles."""

from __future__ import annotations

from math import radians

import bpy
import numpy as np

from precompute.mesh.shapes import Shape

# Relative to the Sky Texture's own radiance.
SKY_STRENGTH = 0.15


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


def plain_material(
    name: str, colour: tuple[float, float, float], roughness: float, *, specular: float = 0.5
) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):  # always on in later versions
        material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["Specular IOR Level"].default_value = specular
    return material


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


def light_by_sky(scene: bpy.types.Scene, azimuth_deg: float, elevation_deg: float) -> None:
    """A clear sky whose sun is where a lamp at this azimuth and elevation would be (studio.py)."""
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
