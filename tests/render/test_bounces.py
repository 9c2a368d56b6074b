# SPDX-License-Identifier: GPL-3.0-or-later
"""The glow is visible to the camera, in sharp mirrors and through clear glass, but not to rays that a rough surface
sends in a random direction: they would hit the narrow orders at random, as white dots on the floor."""

import bpy
import numpy as np
import pytest

from .lamp_scenes import add_grating

PIXELS = 32


@pytest.fixture
def wall(stage, baked):
    """A function that builds a wall with the grating behind a floor and renders the floor alone."""

    def picture(shader: str, samples: int, lit: bool = True, **inputs) -> np.ndarray:
        material, tree = stage.material("Floor")
        node = tree.node(shader)
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        tree.node("ShaderNodeOutputMaterial", tree.value(node.outputs[0]))
        bpy.ops.mesh.primitive_plane_add(size=2)
        bpy.context.object.data.materials.append(material)
        bpy.ops.mesh.primitive_plane_add(size=2, location=(0, 1, 1), rotation=(np.pi / 2, 0, 0))
        add_grating(stage, baked[0])
        assert bpy.ops.grating.assign() == {"FINISHED"}
        for node in bpy.context.object.active_material.node_tree.nodes:
            if node.label == "Skin":
                node.inputs["Base Color"].default_value = (0, 0, 0, 1)
            elif node.label == "Diffraction":
                node.inputs["Strength"].default_value = float(lit)
        stage.lamp("SUN", to=(0.3, -1, 1.5), energy=5.0, angle=0.0)
        # The camera looks down, so the wall is outside the picture and visible only in the floor.
        stage.camera((0, -1.0, 1.5), (0, 0, 0), angle=np.radians(20))
        return stage.rgb("cycles", PIXELS, samples)

    return picture


@pytest.mark.parametrize(
    ("shader", "inputs"),
    [
        ("ShaderNodeBsdfDiffuse", {}),
        ("ShaderNodeBsdfAnisotropic", {"Roughness": 0.3}),
        ("ShaderNodeBsdfPrincipled", {"Roughness": 1.0}),
        ("ShaderNodeBsdfPrincipled", {"Roughness": 0.2}),
    ],
)
def test_rough_floors_find_no_glow_by_chance(wall, shader, inputs):
    """With the same random numbers not one sample may differ between glow and no glow."""
    glowing = wall(shader, 16, **inputs)
    bpy.data.batch_remove([*bpy.data.objects, *bpy.data.materials, *bpy.data.node_groups])
    bpy.context.scene.natural_gratings.items.clear()
    dark = wall(shader, 16, lit=False, **inputs)
    np.testing.assert_array_equal(glowing, dark)


@pytest.mark.parametrize(
    ("shader", "inputs"),
    [("ShaderNodeBsdfAnisotropic", {"Roughness": 0.0}), ("ShaderNodeBsdfPrincipled", {"Roughness": 0.0})],
)
def test_a_sharp_mirror_shows_the_diffraction(wall, shader, inputs):
    picture = wall(shader, 16, **inputs)
    assert picture.max() > 0.05
    assert np.ptp(picture, axis=-1).max() > 0.02, "no colours"
