# SPDX-License-Identifier: GPL-3.0-or-later
"""The Diffraction Lamp lights a screen with the light that the core computes for its patch, and lights nothing else.

The grating is the blazed sample's on a small plane; the screen is a white plane above it. Lamps are hidden from diffuse
surfaces, so only the Diffraction Lamp lights the screen.
"""

import bpy
import numpy as np
import pytest

from precompute.table.radiance import AS_BAKED, Skin, lamp_radiance

from .lamp_scenes import add_grating, keep_from

PIXELS = 128
SCREEN_M = 1.0
HALF_M = 1.2
# From 1 m the corner of the patch is 1.4e-5 rad off its middle: a point to a kernel of 0.01 and more.
SIZE_MM = 0.02
SUN = {"kind": "SUN", "to": (0.3, -0.2, 1), "energy": 1000.0, "angle": 0.0}
POINT = {"kind": "POINT", "location": (0.7, 0.4, 0.9), "energy": 5e3, "shadow_soft_size": 0.0}


def white(stage, name):
    made, tree = stage.material(name)
    shader = tree.node("ShaderNodeBsdfDiffuse", (1.0, 1.0, 1.0, 1.0))
    tree.node("ShaderNodeOutputMaterial", tree.value(shader.outputs[0]))
    return made


def add_screen(stage, height=SCREEN_M):
    """Add a white plane that faces the grating, and a camera just above or below the grating that sees the plane."""
    bpy.ops.mesh.primitive_plane_add(size=4 * HALF_M, location=(0, 0, height))
    bpy.context.object.data.materials.append(white(stage, "Screen"))
    stage.camera((0, 0, 0.2 * np.sign(height)), (0, 0, height), ortho=2 * HALF_M)
    stage.scene.cycles.max_bounces = 0


def add_lit(stage, path, light, rotation=(0.0, 0.0, 0.0)):
    """Add the small plane with the grating as the active object, and a lamp that lights nothing else. Cycles samples
    one lamp per sample, and would also sample this one if it could reach the screen."""
    bpy.ops.mesh.primitive_plane_add(size=0.05, rotation=rotation)
    carrier = bpy.context.object
    carrier.name = "Carrier"
    lamp = stage.lamp(**light)
    keep_from(lamp, carrier, "INCLUDE")
    add_grating(stage, path)
    assert bpy.ops.grating.assign() == {"FINISHED"}
    return carrier, lamp


def add_diffraction_lamp(size_mm=SIZE_MM, **asked):
    assert bpy.ops.grating.add_diffraction_lamp(size_mm=size_mm, **asked) == {"FINISHED"}
    return bpy.data.objects["Diffraction Lamp"]


def screen_points(stage, height=SCREEN_M):
    """The points (n, n, 3) of the screen that the camera's pixels see."""
    bpy.context.view_layer.update()
    x = ((np.arange(PIXELS) + 0.5) / PIXELS * 2 - 1) * HALF_M
    x, y = np.meshgrid(x, -x)
    camera = np.array(stage.scene.camera.matrix_world)
    points = np.stack([x, y, 0 * x, np.ones_like(x)], axis=-1) @ camera.T
    points[..., 2] = height
    return points[..., :3]


def expected(points, table, lamp, *, turn, at=(0, 0, 0), size_mm=SIZE_MM, skin=AS_BAKED, strength=1.0):
    """Radiance (n, n, 3) of the white screen at the points, computed by the core: Lo cos(to) A cos(ts) / r^2 / pi.

    The rows of `turn` (3, 3) are T, B and N of the patch at the position `at`."""
    away = points - np.asarray(at)
    r2 = (away**2).sum(axis=-1)
    wo = away / np.sqrt(r2)[..., None]
    if lamp.data.type == "SUN":
        wi, irradiance = np.array(lamp.matrix_world.col[2].xyz), lamp.data.energy
    else:
        to_lamp = np.array(lamp.matrix_world.translation) - np.asarray(at)
        wi = to_lamp / np.linalg.norm(to_lamp)
        irradiance = lamp.data.energy / (4 * np.pi) / (to_lamp @ to_lamp)
    local = (wo @ turn.T).reshape(-1, 3)
    wi = np.broadcast_to(turn @ wi, local.shape)
    radiance = lamp_radiance(table, wi, local, irradiance=np.full(3, irradiance), skin=skin).reshape(wo.shape)
    area = (size_mm * 1e-3) ** 2 * strength
    cosines = np.maximum(wo @ turn[2], 0) * np.abs(wo[..., 2])
    return radiance * (cosines * area / r2 / np.pi)[..., None]


def turned(rotation):
    """T, B and N, as rows, of a plane whose U runs along its own x."""
    return np.array(rotation.to_matrix()).T


def close(picture, wanted):
    """Compare every pixel above 1 % of the brightest scattered light, with the bounds that test_plane.py gives Direct:
    single precision on the kernel's slopes. The sample's position on the patch adds at most 1.4e-5 / 0.01 of the slope,
    which is 3 where a Gaussian is at 1 %: 0.4 %."""
    bright = wanted.max(axis=-1)
    counted = bright > 0.01 * np.percentile(bright, 99)
    assert counted.sum() > 200
    error = np.abs(picture - wanted)[counted] / bright[counted][:, None]
    assert np.median(error) <= 0.005
    assert np.percentile(error, 95) <= 0.02


def rotation_of(thing):
    return thing.matrix_world.to_quaternion()


@pytest.mark.parametrize("light", [SUN, POINT])
def test_a_screen_receives_what_the_core_says(stage, baked, light):
    path, table = baked
    add_screen(stage)
    carrier, lamp = add_lit(stage, path, light, rotation=(0.2, -0.1, 0.5))
    add_diffraction_lamp()
    wanted = expected(screen_points(stage), table, lamp, turn=turned(rotation_of(carrier)))
    close(stage.rgb(pixels=PIXELS), wanted)


@pytest.mark.short("gold")
@pytest.mark.parametrize("bake", ["baked", "gold"])
def test_settings_of_the_material_count(stage, request, bake):
    # A wide roughness blurs the orders into one band: 300 pixels are lit, and no order's width depends on the grid.
    path, table = request.getfixturevalue(bake)
    add_screen(stage)
    carrier, lamp = add_lit(stage, path, SUN)
    node = next(node for node in carrier.active_material.node_tree.nodes if node.label == "Diffraction")
    asked = {"Rotation": 0.7, "Roughness": 0.3, "IOR": 2.0, "Period Scale": 1.2, "Height Scale": 0.8}
    asked |= {"Strength": 3.0, "Base Blend": 0.25}
    for name, value in asked.items():
        node.inputs[name].default_value = value
    add_diffraction_lamp()
    c, s = np.cos(0.7), np.sin(0.7)
    skin = Skin(roughness=0.3, ior=2.0, period_scale=1.2, height_scale=0.8)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    wanted = expected(screen_points(stage), table, lamp, turn=turn, skin=skin, strength=2.25)
    close(stage.rgb(pixels=PIXELS), wanted)


@pytest.mark.parametrize("persistent", [False, True])
def test_it_follows_its_lamp_and_its_surface(stage, baked, monkeypatch, persistent):
    """Even if Cycles keeps its scene between renders and applies the changes, as in the viewport."""
    monkeypatch.setattr(stage.scene.render, "use_persistent_data", persistent)
    path, table = baked
    add_screen(stage)
    carrier, lamp = add_lit(stage, path, POINT)
    add_diffraction_lamp()
    stage.rgb(pixels=PIXELS)
    lamp.location, lamp.data.energy = (-0.6, 0.5, 1.1), 9e3
    carrier.location, carrier.rotation_euler = (0.1, -0.2, 0.05), (-0.1, 0.3, 1.1)
    bpy.context.view_layer.update()
    turn = turned(rotation_of(carrier))
    wanted = expected(screen_points(stage), table, lamp, turn=turn, at=(0.1, -0.2, 0.05))
    close(stage.rgb(pixels=PIXELS), wanted)


@pytest.mark.night("test_a_screen_receives_what_the_core_says")
def test_a_larger_patch_sends_more(stage, baked):
    # At 20 mm the patch blurs the lobes, but the whole screen still receives its light: 100 times that of 2 mm. The
    # noise of a pixel is below 0.1, and over a thousand pixels are lit. The sun's mirror image covers ten pixels.
    path, _ = baked
    add_screen(stage)
    add_lit(stage, path, SUN | {"angle": 0.2})
    diffraction_lamp = add_diffraction_lamp(size_mm=2.0)
    small = stage.rgb(pixels=PIXELS, samples=16).sum()
    diffraction_lamp.data.size = 0.02
    assert stage.rgb(pixels=PIXELS, samples=16).sum() == pytest.approx(100 * small, rel=0.01)


def test_behind_the_patch_is_dark(stage, baked):
    path, _ = baked
    add_screen(stage, height=-SCREEN_M)
    add_lit(stage, path, SUN)
    add_diffraction_lamp()
    assert stage.rgb(pixels=PIXELS).max() == 0


@pytest.mark.parametrize("how", ["hidden", "behind", "gone"])
def test_without_its_lamp_it_is_dark(stage, baked, how):
    path, _ = baked
    add_screen(stage)
    _, lamp = add_lit(stage, path, POINT)
    add_diffraction_lamp()
    assert stage.rgb(pixels=PIXELS).max() > 0
    if how == "hidden":
        lamp.hide_render = True
    elif how == "behind":
        lamp.location.z = -0.9
    else:
        bpy.data.objects.remove(lamp)
    assert stage.rgb(pixels=PIXELS).max() == 0


@pytest.mark.parametrize("engine", ["cycles", "eevee"])
def test_its_grating_does_not_show_it(stage, baked, engine):
    # The camera sees the patch itself through the grating's own material, with and without the lamp before it.
    # Diffraction does not follow the lamp. EEVEE does not evaluate lamps' nodes and sees no other light either.
    path, _ = baked
    carrier, _ = add_lit(stage, path, SUN)
    # Closures sample one lamp per sample, and would sample this one half of the time.
    assert bpy.ops.grating.lights(lights="LAMPS") == {"FINISHED"}
    bpy.ops.mesh.primitive_plane_add(size=0.05, location=(0.05, 0, 0), rotation=(0, -0.8, 0))
    bpy.context.object.data.materials.append(white(stage, "Wall"))
    bpy.context.view_layer.objects.active = carrier
    stage.camera((0, 0, 1), ortho=0.12)
    stage.scene.cycles.max_bounces = 0
    alone = stage.rgb(engine, pixels=32)
    followed = [lamp.name for lamp in stage.addon.follow.followed_lamps(stage.scene)]
    add_diffraction_lamp(size_mm=30.0)
    with_fan = stage.rgb(engine, pixels=32)
    assert [lamp.name for lamp in stage.addon.follow.followed_lamps(stage.scene)] == followed == ["Lamp"]
    grating = np.zeros((32, 32), bool)
    grating[8:24, 8:24] = True
    assert alone[grating].max() > 0
    np.testing.assert_allclose(with_fan[grating], alone[grating], rtol=1e-6, atol=0)
    assert alone[~grating].max() == 0
    assert (with_fan[~grating].max() > 0) == (engine == "cycles")


def test_a_mirror_shows_the_grating_once(stage, baked):
    # The camera looks up at a mirror that shows the first order of the grating below; the base is black.
    path, _ = baked
    carrier, _ = add_lit(stage, path, SUN | {"to": (-0.22, 0, 1), "use_shadow": False})
    assert bpy.ops.grating.lights(lights="LAMPS") == {"FINISHED"}
    skin = next(node for node in carrier.active_material.node_tree.nodes if node.label == "Skin")
    skin.inputs["Base Color"].default_value = (0, 0, 0, 1)
    bpy.ops.mesh.primitive_plane_add(size=1, location=(0, 0, 0.5))
    made, tree = stage.material("Mirror")
    mirror = tree.node("ShaderNodeBsdfAnisotropic", (1.0, 1.0, 1.0, 1.0), 0.0)
    tree.node("ShaderNodeOutputMaterial", tree.value(mirror.outputs[0]))
    bpy.context.object.data.materials.append(made)
    bpy.context.view_layer.objects.active = carrier
    stage.camera((0, 0, 0.1), (0, 0, 1), ortho=0.04)
    alone = stage.rgb(pixels=16)
    add_diffraction_lamp(size_mm=30.0)
    assert alone.max(axis=-1).min() > 1
    np.testing.assert_allclose(stage.rgb(pixels=16), alone, rtol=1e-5)


def test_a_bake_made_again_reaches_it(stage, baked, gold):
    path, _ = baked
    add_screen(stage)
    carrier, lamp = add_lit(stage, path, SUN)
    add_diffraction_lamp()
    stage.rgb(pixels=PIXELS)
    grating = stage.scene.natural_gratings.active()
    grating.bake_path = str(gold[0])
    stage.addon.making_materials.refresh_group(grating)
    wanted = expected(screen_points(stage), gold[1], lamp, turn=np.eye(3))
    close(stage.rgb(pixels=PIXELS), wanted)


def test_open_shading_language_sends_the_same(stage, baked):
    path, table = baked
    add_screen(stage)
    carrier, lamp = add_lit(stage, path, POINT, rotation=(0.2, -0.1, 0.5))
    add_diffraction_lamp()
    stage.scene.cycles.shading_system = True
    wanted = expected(screen_points(stage), table, lamp, turn=turned(rotation_of(carrier)))
    try:
        close(stage.rgb(pixels=PIXELS), wanted)
    finally:
        stage.scene.cycles.shading_system = False
