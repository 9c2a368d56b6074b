# SPDX-License-Identifier: GPL-3.0-or-later
"""The glow is visible to the camera and in mirrors as it is, and blurred in rough reflections, whose random rays would
hit the narrow orders by chance, as white dots on the floor. Diffuse bounces and fog do not see it."""

import bpy
import numpy as np
import pytest

from .lamp_scenes import add_grating
from .test_every_light import LUMINANCE
from .world_scenes import add_world, assign

PIXELS = 32


@pytest.fixture
def wall(stage, baked):
    """A function that builds a wall with the grating behind a floor and renders the floor alone."""

    def picture(
        shader: str, samples: int, strength: float = 1.0, grating_roughness: float = 0.0, **inputs
    ) -> np.ndarray:
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
                node.inputs["Strength"].default_value = strength
                node.inputs["Roughness"].default_value = grating_roughness
        stage.lamp("SUN", to=(0.3, -1, 1.5), energy=5.0, angle=0.0)
        # The camera looks down, so the wall is outside the picture and visible only in the floor.
        stage.camera((0, -1.0, 1.5), (0, 0, 0), angle=np.radians(20))
        return stage.rgb("cycles", PIXELS, samples)

    return picture


def emptied():
    """Remove the scene's objects, to build another one."""
    bpy.data.batch_remove([*bpy.data.objects, *bpy.data.materials, *bpy.data.node_groups])
    bpy.context.scene.natural_gratings.items.clear()


def test_diffuse_floors_find_no_glow_by_chance(wall):
    """With the same random numbers not one sample may differ between glow and no glow."""
    glowing = wall("ShaderNodeBsdfDiffuse", 16)
    emptied()
    np.testing.assert_array_equal(glowing, wall("ShaderNodeBsdfDiffuse", 16, strength=0.0))


@pytest.mark.parametrize(
    ("shader", "inputs"),
    [("ShaderNodeBsdfAnisotropic", {"Roughness": 0.0}), ("ShaderNodeBsdfPrincipled", {"Roughness": 0.0})],
)
def test_a_sharp_mirror_shows_the_diffraction(wall, shader, inputs):
    picture = wall(shader, 16, **inputs)
    assert picture.max() > 0.05
    assert np.ptp(picture, axis=-1).max() > 0.02, "no colours"


def test_a_rough_floor_shows_the_diffraction_of_a_rough_grating(wall, stage):
    """It shows what a mirror shows of a grating of that roughness. A floor of roughness 0.02 moves light by less than a
    hundredth of the picture."""
    blurred = wall("ShaderNodeBsdfAnisotropic", 16, Roughness=0.02)
    emptied()
    held = stage.addon.lamp_choice.ROUGHNESS
    expected = wall("ShaderNodeBsdfAnisotropic", 16, Roughness=0.0, grating_roughness=held)
    assert np.abs(blurred - expected).mean() < 0.02 * expected.mean()


@pytest.fixture
def floor(stage, disc):
    """A function that renders a floor, of a roughness, that reflects a disc under a sun."""

    def picture(roughness: float, samples: int) -> np.ndarray:
        add_world(stage, (0.05, 0.06, 0.08))
        material, tree = stage.material("Floor")
        glossy = tree.node("ShaderNodeBsdfAnisotropic", (0.8, 0.8, 0.8, 1.0), roughness)
        tree.node("ShaderNodeOutputMaterial", tree.value(glossy.outputs[0]))
        bpy.ops.mesh.primitive_plane_add(size=6)
        bpy.context.object.data.materials.append(material)
        turn = (np.pi / 2 - 0.15, 0, 0)
        bpy.ops.mesh.primitive_circle_add(
            vertices=128, radius=0.6, fill_type="NGON", location=(0, 1, 0.62), rotation=turn
        )
        stage.lamp("SUN", to=(0.5, -1, 1.2), energy=3.0, angle=np.radians(2))
        assign(stage, disc[0], "REST")
        assert bpy.ops.grating.direction(kind="RADIAL", axis="Z") == {"FINISHED"}
        stage.camera((0, -2.6, 1.0), (0, 0.25, 0), angle=np.radians(20))
        return stage.rgb("cycles", 48, samples)[18:]  # the floor alone

    return picture


@pytest.mark.night("test_a_rough_floor_shows_the_diffraction_of_a_rough_grating")
def test_a_disc_in_a_rough_floor(floor, stage, monkeypatch):
    """No pixel is much brighter than the median of its neighbours: the noise of a pixel is a tenth at 64 samples. The
    luminance is that without a blur, within 5 %, and 1 % of noise: the blur moves light about the disc, and some beyond
    the horizon."""
    luminance = floor(0.3, 64) @ LUMINANCE
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(luminance, 1, mode="edge"), (3, 3))
    around = np.delete(windows.reshape(*luminance.shape, 9), 4, axis=-1)
    assert (luminance / np.median(around, axis=-1)).max() < 2.5
    emptied()
    monkeypatch.setattr(stage.addon.lamp_choice, "ROUGHNESS", 0.0)
    assert luminance.mean() == pytest.approx((floor(0.3, 64) @ LUMINANCE).mean(), rel=0.06)
