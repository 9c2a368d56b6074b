# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of a surface in a world, over a black base: all visible light is diffracted."""

import bpy
import numpy as np

from tests.addon.worlds.made import painted, world_with
from tests.precompute.world_sources.worlds import direction, disc, picture, sky

from .lamp_scenes import add_grating


def assign(stage, path, lights: str):
    """Assign the grating of a file to the active object, over black."""
    add_grating(stage, path)
    grating = stage.scene.natural_gratings.active()
    assert bpy.ops.grating.lights(lights=lights) == {"FINISHED"}
    assert bpy.ops.grating.assign() == {"FINISHED"}
    skin = next(node for node in grating.material.node_tree.nodes if node.label == "Skin")
    skin.inputs["Base Color"].default_value = (0, 0, 0, 1)
    return grating


def add_world(stage, colour=(1.0, 1.0, 1.0)):
    """Set a world of one colour; returns the Color input of its Background node."""
    world = bpy.data.worlds.new("World")
    stage.addon.compat.enable_nodes(world)
    world.probe_resolution = "128"  # of one colour: EEVEE's default of 2048 costs a second a picture
    stage.scene.world = world
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*colour, 1)
    return background.inputs["Color"]


def add_soft_boxes(stage):
    """Set a world of two soft boxes in a dim sky."""
    world, background = world_with("ShaderNodeTexEnvironment")
    image = painted(picture(sky() + 20 * disc(direction(40, -60), 5) + 20 * disc(direction(25, -150), 9)))
    image.pack()
    background.inputs["Color"].links[0].from_node.image = image
    stage.scene.world = world


def add_ball():
    """Add a smooth ball and select only it."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64)
    bpy.ops.object.shade_smooth()
    bpy.context.object.name = "Ball"


def look_at_ball(stage):
    """Add a camera in whose picture the ball is 5/8 high."""
    stage.camera((0, -3.0, 0.5), (0, 0, 0), angle=np.radians(42))
