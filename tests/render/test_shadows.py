# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays: a card between the sun and half of a plane shades exactly that half."""

import bpy
import numpy as np
import pytest

from .test_lamps import lambertian

PIXELS = 32


def shaded(stage, addon, response, *, engine: str = "cycles", casts: bool, osl: bool) -> np.ndarray:
    """The radiance (n, n), green, of a plane with a response; a card shades its right half."""
    stage.camera((0, 0, 3), ortho=2.0).rotation_euler = (0, 0, 0)
    bpy.ops.mesh.primitive_plane_add(size=4)
    plane = bpy.context.object
    # The card is above the camera's view, over x > 0; the sun is overhead.
    bpy.ops.mesh.primitive_plane_add(size=4, location=(2, 0, 5))
    sun = stage.lamp("SUN", to=(0, 0, 1), energy=np.pi, angle=0.0)
    sun.data.use_shadow = casts
    stage.scene.cycles.shading_system = osl
    addon.follow.follow_lamps(stage.scene)
    group = addon.skin.group_around("shaded", response, shadows=True)
    material, tree = stage.material("Shaded")
    tree.node("ShaderNodeOutputMaterial", tree.group(group)["Shader"])
    plane.data.materials.append(material)
    picture = stage.rgb(engine, PIXELS)[..., 1]
    stage.scene.cycles.shading_system = False
    return picture


@pytest.mark.parametrize("casts", [True, False])
def test_a_card_shades_what_lies_under_it(stage, addon, casts):
    picture = shaded(stage, addon, lambertian(addon), casts=casts, osl=not addon.compat.HAS_RAYCAST)
    # Irradiance pi on a white Lambertian: 1, to single precision.
    lit, under = picture[:, : PIXELS // 2], picture[:, PIXELS // 2 :]
    np.testing.assert_allclose(lit, 1, rtol=1e-5)
    np.testing.assert_allclose(under, 0 if casts else 1, rtol=1e-5)


# EEVEE's picture has half floats, of eleven bits.
@pytest.mark.parametrize(("engine", "rtol"), [("cycles", 1e-5), ("eevee", 2e-3)])
def test_where_no_shadow_ray_is_there_is_no_shadow(stage, addon, engine, rtol):
    if addon.compat.HAS_RAYCAST:
        pytest.skip("this Blender traces shadow rays without Open Shading Language")
    picture = shaded(stage, addon, lambertian(addon), engine=engine, casts=True, osl=False)
    np.testing.assert_allclose(picture, 1, rtol=rtol)
