# SPDX-License-Identifier: GPL-3.0-or-later
"""The light rig: its lamps and where they stand, what it replaces and leaves, and refusals.

tests/render/test_light_rig.py tests its light."""

import math

import bpy
import numpy as np
import pytest
from mathutils import Vector

from tests.addon.conftest import add_camera, reports, select
from tests.addon.layout import listed_properties

KINDS = {
    "SUN": ["Rig Sun"],
    "STUDIO": ["Soft Box", "Second Soft Box", "Fill"],
    "WINDOW": ["Window", "Bounce"],
    "POINTS": ["First Point", "Second Point"],
    "GRID": ["Gridded Soft Box", "Fill"],
}
# Visible wavelengths over the period of 500 nm of the scan, each widened by a cell of the candidates, 0.052.
U_LOW, U_HIGH = 380 / 500 - 0.052, 720 / 500 + 0.052


@pytest.fixture
def lit(watched, addon, monkeypatch):
    """The watched plane, without its rig afterwards. Forty patches of so even a plane find what 80 do, and lamps need
    no nodes."""
    for name, fewer in {"_PATCHES": 40, "_MORE_PATCHES": 60, "_SHADOW_PLACES": 3}.items():
        monkeypatch.setattr(addon.adding_light_rigs, name, fewer)
    monkeypatch.setattr(addon.lighting, "show_lamps", lambda **_: None)
    yield watched
    for collection in list(bpy.data.collections):
        bpy.data.collections.remove(collection)


def rig():
    """The lamps in the rig's collection, by name."""
    return {thing.name: thing for thing in bpy.data.collections["Light Rig"].objects}


def to_lamp(lamp) -> np.ndarray:
    bpy.context.view_layer.update()
    return np.array(lamp.matrix_world.to_3x3().normalized().col[2])


def fails(capfd, **settings) -> str:
    """The one line of an error. Nothing changes."""
    before = sorted(each.name for each in (*bpy.data.objects, *bpy.data.lights, *bpy.data.collections))
    capfd.readouterr()
    with pytest.raises(RuntimeError) as raised:
        bpy.ops.grating.light_rig(**settings)
    assert sorted(each.name for each in (*bpy.data.objects, *bpy.data.lights, *bpy.data.collections)) == before
    lines = str(raised.value).strip().splitlines()
    assert len(lines) == 1
    return lines[0]


@pytest.mark.night("test_the_key_stands_where_the_grating_equation_says")
@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_has_its_lamps_in_a_collection_of_their_own(lit, kind, capfd):
    out = reports(lambda: bpy.ops.grating.light_rig(kind=kind), capfd)
    assert "Light Rig: " in out and "On: Plane" in out and "Warning" not in out
    assert list(rig()) == KINDS[kind]
    for lamp in rig().values():
        assert lamp.users_collection == (bpy.data.collections["Light Rig"],)
        # Each shines along its own -Z at the middle of the plane, which is less than 0.1 off the places' mean.
        if lamp.data.type != "SUN":
            side = np.cross(to_lamp(lamp), np.array(lamp.location))
            assert np.linalg.norm(side) < 0.1
    assert [o.name for o in bpy.context.scene.collection.objects if o.type == "LIGHT"] == ["Sun"]


@pytest.mark.short("GRID", "STUDIO")
@pytest.mark.parametrize("kind", KINDS)
def test_the_key_stands_where_the_grating_equation_says(lit, kind):
    """The plane is seen from its normal, so u is the x component of the direction to the lamp."""
    bpy.ops.grating.light_rig(kind=kind)
    key = to_lamp(rig()[KINDS[kind][0]])
    assert U_LOW <= abs(key[0]) <= U_HIGH
    assert key[2] > math.sin(math.radians(5)) - 0.08  # the refinement may go down by a cell and a half


def test_period_scale_moves_the_key(lit):
    node = next(n for n in lit.active_material.node_tree.nodes if n.label == "Diffraction")
    node.inputs["Period Scale"].default_value = 2.0
    bpy.ops.grating.light_rig()
    assert U_LOW / 2 - 0.026 <= abs(to_lamp(rig()["Rig Sun"])[0]) <= U_HIGH / 2 + 0.026


def test_rotation_turns_the_key(lit):
    node = next(n for n in lit.active_material.node_tree.nodes if n.label == "Diffraction")
    node.inputs["Rotation"].default_value = math.pi / 2
    bpy.ops.grating.light_rig()
    assert U_LOW <= abs(to_lamp(rig()["Rig Sun"])[1]) <= U_HIGH


def grey(lamp, middle=(0.0, 0.0, 0.0)) -> float:
    """The radiance of a 50 % grey surface that faces a lamp, by Blender's units of strength
    (lamps/brightest_lamps.py). An area lamp has the form factor of a disc of its area."""
    data, squared = lamp.data, (lamp.location - Vector(middle)).length_squared
    if data.type == "SUN":
        irradiance = data.energy
    elif data.type in {"POINT", "SPOT"}:
        irradiance = data.energy / (4 * math.pi * squared)
    else:
        irradiance = data.energy / (math.pi * squared + data.size * data.size_y)
    return 0.5 * irradiance / math.pi


@pytest.mark.short("SUN", "WINDOW")
@pytest.mark.parametrize("kind", KINDS)
def test_the_key_exposes_grey(lit, kind):
    """The plane is 20 mm wide."""
    lit.scale = (0.01, 0.01, 0.01)
    bpy.context.scene.camera.location.z = 0.1
    bpy.context.view_layer.update()
    bpy.ops.grating.light_rig(kind=kind, strength=1.0)
    # The location of the middle is known to 5 %, the distance between the camera's rays.
    assert grey(rig()[KINDS[kind][0]]) == pytest.approx(0.4, rel=0.05)
    bpy.ops.grating.light_rig(kind=kind, strength=3.0)
    assert grey(rig()[KINDS[kind][0]]) == pytest.approx(1.2, rel=0.05)


def test_orders_are_lit_by_wide_suns_where_the_grating_equation_says(lit):
    """Each lamp of the plane shows a first order. A wide sun is 4.5 degrees wide; a factor of the key is at most 8."""
    bpy.ops.grating.light_rig(kind="ORDERS", strength=0.5)
    lamps = list(rig().values())
    assert lamps[0].name == "Order Light"
    for lamp in lamps:
        assert lamp.data.type == "SUN" and math.degrees(lamp.data.angle) == pytest.approx(4.5)
        assert U_LOW <= abs(to_lamp(lamp)[0]) <= U_HIGH
        factor = lamp.data.energy / (0.5 * 0.8 * math.pi)
        assert min(abs(math.log2(factor) - power) for power in (-1, 0, 1, 2, 3)) < 1e-3


def test_a_flash_stands_beside_the_lens_on_the_side_of_the_colours(lit):
    """From a camera at 30 degrees, a flash at its right or left has u = sin(30) + sin(38) = 1.12 or sin(30) + sin(22) =
    0.87, both in the order's 0.76 to 1.44 and with v = 0. Above the lens v is not 0."""
    camera = bpy.context.scene.camera
    for tilt in (30, -30):
        camera.location = 10 * Vector((math.sin(math.radians(tilt)), 0, math.cos(math.radians(tilt))))
        camera.rotation_euler = (0, math.radians(tilt), 0)
        bpy.context.view_layer.update()
        bpy.ops.grating.light_rig(kind="FLASH")
        (flash,) = rig().values()
        middle = flash.location - flash.matrix_world.to_3x3().normalized().col[2] * camera.location.length
        angle = (flash.location - middle).angle(camera.location - middle)
        assert math.degrees(angle) == pytest.approx(8, abs=0.2)
        assert abs(flash.location.y) < 0.1


def test_a_grid_lights_the_object_and_not_the_ground_beside_it(lit):
    """The object's edge is at atan(1 / 4) = 14 degrees, within the full light. From 20 degrees on there is none."""
    bpy.ops.grating.light_rig(kind="GRID")
    spot = rig()["Gridded Soft Box"].data
    outer = math.cos(spot.spot_size / 2)
    full = math.degrees(math.acos(outer + (1 - outer) * spot.spot_blend))
    assert spot.type == "SPOT" and math.degrees(math.atan(1 / 4)) < full < 18
    assert math.degrees(spot.spot_size / 2) == pytest.approx(20)


@pytest.mark.night("test_undo_leaves_nothing")
def test_softness_scales_the_lamps(lit):
    bpy.ops.grating.light_rig(kind="STUDIO")
    before = rig()["Soft Box"].data.size
    bpy.ops.grating.light_rig(kind="STUDIO", softness=0.5)
    assert rig()["Soft Box"].data.size == pytest.approx(before / 2)


@pytest.mark.night("test_the_key_stands_where_the_grating_equation_says")
def test_it_replaces_its_own_lamps_and_no_others(lit):
    scene = bpy.context.scene
    world = scene.world
    sun = bpy.data.objects["Sun"]
    kept = sun.matrix_world.copy(), sun.data.energy, sun.data.angle
    for kind, names in (("STUDIO", KINDS["STUDIO"]), ("WINDOW", KINDS["WINDOW"]), ("WINDOW", KINDS["WINDOW"])):
        bpy.ops.grating.light_rig(kind=kind)
        assert list(rig()) == names
        assert not any(map(listed_properties, rig().values()))
        assert sorted(light.name for light in bpy.data.lights) == sorted([*names, "Sun"])
    assert (sun.matrix_world, sun.data.energy, sun.data.angle) == kept
    assert scene.world == world and "Light Rig.001" not in bpy.data.collections
    assert scene.render.engine == bpy.context.scene.render.engine


@pytest.mark.night("test_the_material_follows_its_lamps")
def test_an_artists_lamp_in_its_collection_stays(lit):
    bpy.ops.grating.light_rig()
    own = bpy.data.objects.new("Own", bpy.data.lights.new("Own", "POINT"))
    bpy.data.collections["Light Rig"].objects.link(own)
    bpy.ops.grating.light_rig(kind="POINTS")
    assert sorted(rig()) == ["First Point", "Own", "Second Point"]


def test_an_artists_collection_of_its_name_stays_as_it_is(lit):
    own = bpy.data.collections.new("Light Rig")
    bpy.context.scene.collection.children.link(own)
    bpy.ops.grating.light_rig()
    assert not own.objects
    assert [o.name for o in bpy.data.collections["Light Rig.001"].objects] == ["Rig Sun"]


def test_the_material_follows_its_lamps(lit, addon):
    bpy.ops.grating.light_rig(kind="POINTS")
    assert {lamp.name for lamp in addon.follow.followed_lamps(bpy.context.scene)} == {
        "Sun", "First Point", "Second Point",
    }  # fmt: skip


def test_undo_leaves_nothing(lit):
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.grating.light_rig(kind="STUDIO")
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert not bpy.data.collections
    assert [light.name for light in bpy.data.lights] == ["Sun"]


def test_all_objects_with_gratings_if_the_active_one_shows_none(lit):
    other = bpy.data.objects.new("Empty", None)
    bpy.context.scene.collection.objects.link(other)
    select(other)
    assert bpy.ops.grating.light_rig() == {"FINISHED"}
    assert list(rig()) == ["Rig Sun"]


def test_a_roof_moves_the_lamp(lit):
    """A wall hides the left half of the sky. The grating itself has no preference between left and right."""
    bpy.ops.mesh.primitive_plane_add(size=40, location=(-1.2, 0, 0), rotation=(0, math.pi / 2, 0))
    wall = bpy.context.object
    bpy.context.scene.camera.data.clip_end = 1000
    select(lit)
    bpy.ops.grating.light_rig()
    assert to_lamp(rig()["Rig Sun"])[0] > 0
    wall.location.x = 1.2
    bpy.context.view_layer.update()
    bpy.ops.grating.light_rig()
    assert to_lamp(rig()["Rig Sun"])[0] < 0


def test_faults_are_one_line(lit, capfd, tmp_path):
    scene = bpy.context.scene
    camera = scene.camera
    scene.camera = None
    assert "no camera" in fails(capfd) and "add one" in fails(capfd)
    scene.camera = camera
    camera.location.z = -10
    camera.rotation_euler.x = 0
    bpy.context.view_layer.update()
    assert "the camera sees nothing of its grating" in fails(capfd)
    camera.location.z = 10
    bpy.context.view_layer.update()
    grating = scene.natural_gratings.active()
    grating.bake_path = str(tmp_path / "gone.exr")
    grating.group.nodes.clear()  # with them the packed pictures, from which the bake could be written again
    assert "gone.exr is gone" in (line := fails(capfd)) and "load it again" in line
    lit.data.materials.clear()
    assert "no object shows a grating" in fails(capfd)
    assert "press Assign to Selected" in fails(capfd)


def test_a_view_without_a_camera(lit, addon):
    """A perspective and a flat 3D view from above, as Blender's matrices describe them, light the plane like the
    camera."""
    from types import SimpleNamespace

    from mathutils import Matrix

    scene = bpy.context.scene
    camera = scene.camera
    depsgraph = bpy.context.evaluated_depsgraph_get()
    flat = Matrix(((0.1, 0, 0, 0), (0, 0.18, 0, 0), (0, 0, -0.001, 0), (0, 0, 0, 1)))
    lens = camera.calc_matrix_camera(depsgraph, x=160, y=90)
    scene.camera = None
    m = addon.adding_light_rigs
    for window in (lens, flat):
        view = SimpleNamespace(view_matrix=Matrix.Translation((0, 0, -10)), window_matrix=window, view_distance=10.0)
        m.add_light_rig(scene, depsgraph, m.Rig(), objects=[lit], view=view)
        assert U_LOW <= abs(to_lamp(rig()["Rig Sun"])[0]) <= U_HIGH
    scene.camera = camera
    pixels, by_camera = addon.seen_surfaces.ViewPixels(view), addon.seen_surfaces.Pixels(scene, camera)
    seen = addon.seen_surfaces.ViewPixels(SimpleNamespace(
        view_matrix=camera.matrix_world.inverted(), window_matrix=lens, view_distance=10.0,
    ))  # fmt: skip
    at = np.random.default_rng(0).uniform(size=(20, 2))
    # Blender's matrices are in single precision.
    for one, other in zip(seen.rays(at), by_camera.rays(at), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-5)
    assert pixels.rays(at)[1] == pytest.approx(np.tile((0, 0, -1), (20, 1)))


def test_a_view_stands_before_the_camera_only_if_asked(lit, addon):
    """The operator asks for it where the artist looks at the scene, and not through its camera."""
    from types import SimpleNamespace

    from mathutils import Matrix

    scene, depsgraph = bpy.context.scene, bpy.context.evaluated_depsgraph_get()
    lens = scene.camera.calc_matrix_camera(depsgraph, x=160, y=90)
    view = SimpleNamespace(view_matrix=Matrix.Translation((0, 0, -10)), window_matrix=lens, view_perspective="PERSP")
    for asked, kind in ((True, addon.seen_surfaces.ViewPixels), (False, addon.seen_surfaces.Pixels)):
        assert type(addon.seen_surfaces.seen_from(scene, depsgraph, view, from_view=asked)) is kind


@pytest.mark.parametrize(("perspective", "taken"), [("PERSP", "VIEW"), ("ORTHO", "VIEW"), ("CAMERA", "CAMERA")])
def test_the_button_takes_what_the_artist_looks_through_and_shows_it_rendered(addon, perspective, taken):
    from types import SimpleNamespace

    shading = SimpleNamespace(type="SOLID")
    view = SimpleNamespace(view_perspective=perspective)
    context = SimpleNamespace(space_data=SimpleNamespace(shading=shading, region_3d=view))
    for done, shown in (({"CANCELLED"}, "SOLID"), ({"FINISHED"}, "RENDERED")):
        operator = SimpleNamespace(seen_from="CAMERA", execute=lambda _, done=done: done)
        assert addon.light.AddLightRig.invoke(operator, context, None) == done
        assert (operator.seen_from, shading.type) == (taken, shown)


def test_points_in_the_picture(lit, addon):
    """The camera, of 50 mm on 36 mm, sees 3.6 to each side at its distance of 10, and 9 / 16 of it up and down."""
    pixels = addon.seen_surfaces.Pixels(bpy.context.scene, bpy.context.scene.camera)
    inside = np.array([(0, 0, 0), (3.5, 0, 0), (0, 1.9, 0), (1.7, 0, 5)])
    outside = np.array([(3.7, 0, 0), (0, 2.1, 0), (1.9, 0, 5), (0, 0, 20)])
    assert pixels.shows(inside).all()
    assert not pixels.shows(outside).any()


def test_by_command(lit, addon, tmp_path, capfd):
    blend = tmp_path / "lit.blend"
    assert addon.commands.execute(["light-rig", "--kind", "studio", "--strength", "2", "--save", str(blend)]) == 0
    assert blend.is_file()
    assert list(rig()) == KINDS["STUDIO"]
    assert grey(rig()["Soft Box"]) == pytest.approx(0.8, rel=0.05)
    add_camera(bpy.context.scene, (0, 0, 10))
    capfd.readouterr()
    assert addon.commands.execute(["light-rig", "--object", "Sun"]) != 0
    assert addon.commands.execute(["light-rig", "--kind", "moon"]) != 0
    bpy.ops.mesh.primitive_cube_add()
    assert addon.commands.execute(["light-rig", "--object", "Cube"]) != 0
    lines = [line for line in capfd.readouterr().err.splitlines() if line.startswith("error:")]
    assert len(lines) == 3
    assert "it shows no grating" in lines[2]
