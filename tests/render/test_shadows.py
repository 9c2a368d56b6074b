# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays: a card between the sun and half of a plane, whose diffraction is a mirror's there and everywhere."""

import bpy
import numpy as np
import pytest

from .test_key_lights import lambertian

PIXELS = 32


@pytest.mark.parametrize("casts", [True, False])
def test_a_card_shades_what_lies_under_it(stage, addon, casts):
    stage.camera((0, 0, 3), ortho=2.0).rotation_euler = (0, 0, 0)
    bpy.ops.mesh.primitive_plane_add(size=4)
    plane = bpy.context.object
    # Above the camera's view, over x > 0: the sun is overhead.
    bpy.ops.mesh.primitive_plane_add(size=4, location=(2, 0, 5))
    sun = stage.lamp("SUN", to=(0, 0, 1), energy=np.pi, angle=0.0)
    sun.data.use_shadow = casts
    stage.scene.cycles.shading_system = not addon.compat.HAS_RAYCAST
    addon.key_lights.follow_lamps(stage.scene)
    group = addon.diffraction.group_around("lambertian", lambertian(addon), shadows=True)
    material, tree = stage.material("Shaded")
    tree.node("ShaderNodeOutputMaterial", tree.group(group, IOR=1.0)["Shader"])
    plane.data.materials.append(material)
    picture = stage.rgb("cycles", PIXELS)[..., 1]
    stage.scene.cycles.shading_system = False
    # Irradiance pi on a white Lambertian: 1, to single precision.
    lit, under = picture[:, : PIXELS // 2], picture[:, PIXELS // 2 :]
    np.testing.assert_allclose(lit, 1, rtol=1e-5)
    np.testing.assert_allclose(under, 0 if casts else 1, rtol=1e-5)
