# SPDX-License-Identifier: GPL-3.0-or-later
"""The fakes of `./dev bench picture` match their descriptions."""

import bpy
import numpy as np
import pytest

from laboratory.benchmarks import lights_scenes as scenes
from laboratory.benchmarks.picture_fakes import lobes, rainbow_response
from precompute.colour.spaces import rgb_from_xyz
from precompute.methods.gem import Gem
from precompute.methods.method import Settings

PERIOD_M = 1.15e-6


@pytest.fixture
def studio(stage, skin):
    """The benchmark's studio, with a plane under a camera that looks down."""
    studio = scenes.Worlds(stage.addon, stage.folder, 16, skin[0])
    scenes.build(studio, "disc")
    camera = studio.scene.camera
    camera.data.type, camera.data.ortho_scale = "ORTHO", 0.01
    camera.location, camera.rotation_euler = (0, 0, 1), (0, 0, 0)
    return studio


def shown(studio, material, degrees: float) -> np.ndarray:
    """The radiance (3,) of the plane along the normal, under a sun of 1 W/m2 tilted along U."""
    bpy.data.batch_remove([lamp for lamp in bpy.data.objects if lamp.type == "LIGHT"])
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy, data.angle = 1.0, 0.0
    sun = bpy.data.objects.new("Sun", data)
    sun.rotation_euler = (0, np.radians(degrees), 0)
    studio.scene.collection.objects.link(sun)
    studio.addon.lighting.update_lamps(studio.scene)
    studio.mesh.material_slots[0].material = material
    return studio.render(64).mean(axis=(0, 1))


def test_a_lobe_of_each_colour_is_where_its_order_is(studio):
    """A mirror's half vector leans by lambda / 2 d: red light comes from 30 degrees, blue light from 23."""
    material = bpy.data.materials.new("Three Lobes")
    studio.addon.compat.enable_nodes(material)
    material.node_tree.nodes.clear()
    tree = studio.addon.builder.Tree(material.node_tree)
    tree.node("ShaderNodeOutputMaterial", lobes(tree, PERIOD_M))
    far, near = shown(studio, material, 45), shown(studio, material, 10)
    assert far[0] > far[1] > far[2] > 0
    assert near[2] > near[1] > near[0] > 0
    assert shown(studio, material, -30).max() < 0.5 * shown(studio, material, 30).max(), "one side only"


@pytest.mark.parametrize("degrees", [0, 25, -40])
def test_the_rainbow_is_that_of_the_method(studio, degrees):
    """The same formula as in precompute.methods, in single precision."""
    addon = studio.addon
    skin = addon.skin.group_around("Rainbow", rainbow_response(addon, PERIOD_M), shadows=False, lights="LAMPS")
    material = addon.material.new_diffraction_material("Rainbow", skin)
    base = next(node for node in material.node_tree.nodes if node.label == "Skin")
    base.inputs["Base Color"].default_value = (0, 0, 0, 1)
    picture = shown(studio, material, degrees)
    half = np.array((np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees)) + 1))
    xyz = Gem(PERIOD_M, Settings()).xyz(*half[:, None])[0]
    np.testing.assert_allclose(picture, rgb_from_xyz("Rec.709") @ xyz, rtol=1e-3, atol=1e-4)
