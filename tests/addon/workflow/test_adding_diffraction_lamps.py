# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding a Diffraction Lamp: placement, refusals, messages. tests/render/test_diffraction_lamp.py tests its light."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix, Vector

from tests.addon.conftest import reports


@pytest.fixture
def carrier(scene, grating):
    """The plane with the grating, active, under a sun."""
    bpy.ops.grating.lights(lights="LAMPS")
    assert bpy.ops.grating.assign() == {"FINISHED"}
    scene.render.engine = "CYCLES"
    yield bpy.context.object
    bpy.context.scene.cursor.location = (0, 0, 0)


def added() -> bpy.types.Object:
    return next(o for o in bpy.data.objects if o.type == "LIGHT" and "ng_fan" in o.data)


def axes(thing) -> np.ndarray:
    bpy.context.view_layer.update()
    return np.array(thing.matrix_world.to_3x3().normalized())


def test_it_says_what_it_did(carrier, capfd):
    out = reports(bpy.ops.grating.add_diffraction_lamp, capfd)
    assert "Diffraction Lamp: on Plane, throws the colours of Sun; only Cycles shows them" in out
    assert "Warning" not in out


def test_it_warns(scene, carrier, capfd):
    bpy.ops.grating.lights(lights="REST")
    scene.render.engine = "BLENDER_WORKBENCH"
    node = next(n for n in carrier.active_material.node_tree.nodes if n.label == "Diffraction")
    value = carrier.active_material.node_tree.nodes.new("ShaderNodeValue")
    carrier.active_material.node_tree.links.new(value.outputs[0], node.inputs["Roughness"])
    bpy.data.objects["Sun"].rotation_euler = (3.0, 0, 0)
    bpy.context.view_layer.update()
    out = reports(bpy.ops.grating.add_diffraction_lamp, capfd)
    for told in ("Roughness", "Sun: it is behind the patch", "Caustics > Reflective", "only Cycles"):
        assert told in out


def test_its_axes_are_those_of_the_scan(carrier):
    """It shines along its -Z, the normal; its X is U, here turned by the material's Rotation."""
    carrier.rotation_euler = (0.3, 0.2, 0.1)
    carrier.scale = (2, 2, 2)
    node = next(n for n in carrier.active_material.node_tree.nodes if n.label == "Diffraction")
    node.inputs["Rotation"].default_value = np.pi / 2
    bpy.ops.grating.add_diffraction_lamp(size_mm=20)
    plane, lamp = axes(carrier), axes(added())
    # Single precision, through the product of two matrices.
    np.testing.assert_allclose(lamp[:, 2], -plane[:, 2], atol=1e-6)
    np.testing.assert_allclose(lamp[:, 0], plane[:, 1], atol=1e-6)
    np.testing.assert_allclose(lamp[:, 1], plane[:, 0], atol=1e-6)
    # A twentieth of its size above the surface; its size ignores the plane's scale.
    np.testing.assert_allclose(added().matrix_world.translation, 0.001 * plane[:, 2], atol=1e-7)
    assert added().data.size == pytest.approx(0.02)
    np.testing.assert_allclose(added().matrix_world.to_scale(), 1, atol=1e-6)


def test_its_place_is_nearest_to_the_cursor(scene, carrier):
    scene.cursor.location = (0.3, -0.7, 5)
    bpy.ops.grating.add_diffraction_lamp(size_mm=1)
    bpy.context.view_layer.update()
    np.testing.assert_allclose(added().matrix_world.translation, (0.3, -0.7, 5e-5), atol=1e-6)


def test_it_stays_on_its_object(carrier):
    bpy.ops.grating.add_diffraction_lamp(size_mm=1)
    bpy.context.view_layer.update()
    before = added().matrix_world.copy()
    carrier.matrix_world = Matrix.Translation((1, 2, 3))
    bpy.context.view_layer.update()
    np.testing.assert_allclose(added().matrix_world.translation - before.translation, (1, 2, 3), atol=1e-6)


def test_modifiers_and_smooth_shading_count(scene, carrier):
    """On a smooth ball the normal is the ball's own; U runs around it, as Blender unwraps a ball."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, radius=0.5)
    bpy.ops.object.shade_smooth()
    ball = bpy.context.object
    bpy.ops.grating.assign()
    array = ball.modifiers.new("Array", "ARRAY")
    array.use_relative_offset, array.use_constant_offset = False, True
    array.constant_offset_displace = (2, 0, 0)
    out = Vector((0.48, -0.6, 0.64))
    scene.cursor.location = Vector((2, 0, 0)) + out * 0.5
    bpy.ops.grating.add_diffraction_lamp(size_mm=1)
    lamp = axes(added())
    # Facets of 3.75 degrees: their shading normals follow the ball to the square of half of that, 1e-3.
    np.testing.assert_allclose(-lamp[:, 2], out, atol=2e-3)
    around = np.cross((0, 0, 1), out)
    # U is constant along a facet: it is off by half of 3.75 degrees, 0.033.
    np.testing.assert_allclose(lamp[:, 0], around / np.linalg.norm(around), atol=0.04)
    assert np.linalg.norm(added().matrix_world.translation - Vector((2, 0, 0))) == pytest.approx(0.5, abs=1e-3)


def test_the_lamp_that_lights_it(scene, carrier, addon, capfd):
    data = bpy.data.lights.new("Weak", "POINT")
    scene.collection.objects.link(bpy.data.objects.new("Weak", data))
    out = reports(lambda: bpy.ops.grating.add_diffraction_lamp(lamp="Weak"), capfd)
    assert "throws the colours of Weak" in out
    scene.objects["Sun"].data.energy = 1e-3
    bpy.data.lights["Weak"].type = "SUN"
    out = reports(bpy.ops.grating.add_diffraction_lamp, capfd)
    assert f"throws the colours of {addon.follow.followed_lamps(scene)[0].name}" in out
    with pytest.raises(RuntimeError, match="Moon: no lamp of the scene; there are Sun, Weak"):
        bpy.ops.grating.add_diffraction_lamp(lamp="Moon")
    with pytest.raises(RuntimeError, match="Diffraction Lamp: no lamp of the scene"):
        bpy.ops.grating.add_diffraction_lamp(lamp="Diffraction Lamp")
    assert [lamp.name for lamp in addon.brightest_lamps.lamps_of(scene)] == ["Sun", "Weak"]


def test_diffraction_does_not_follow_it(scene, carrier, addon):
    bpy.ops.grating.add_diffraction_lamp()
    added().data.energy = 1e6
    addon.lighting.update_all_lamps()
    assert [lamp.name for lamp in addon.follow.followed_lamps(scene)] == ["Sun"]
    assert not addon.brightest_lamps.unfollowed_features(scene, addon.follow.followed_lamps(scene))
    holder = bpy.data.collections.new("Held")
    scene.collection.children.link(holder)
    holder.objects.link(added())
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", holder
    scene.collection.objects.link(empty)
    assert not addon.brightest_lamps.instanced_lamps(bpy.context.evaluated_depsgraph_get())


def nothing_added():
    assert not [o for o in bpy.data.objects if o.type == "LIGHT" and "ng_fan" in o.data]
    assert not [data for data in bpy.data.lights if "ng_fan" in data]


def test_what_it_refuses(scene, carrier):
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    with pytest.raises(RuntimeError, match="no lamp lights the grating; add a sun"):
        bpy.ops.grating.add_diffraction_lamp()
    bpy.ops.grating.add_sun()
    for loop in carrier.data.uv_layers.active.data:
        loop.uv = (0, 0)
    with pytest.raises(RuntimeError, match="Plane: its UV map has no area there"):
        bpy.ops.grating.add_diffraction_lamp()
    carrier.data.uv_layers.remove(carrier.data.uv_layers[0])
    carrier.data.update()
    with pytest.raises(RuntimeError, match="Plane: no UV map, so no direction for the grating; press Comb Grating"):
        bpy.ops.grating.add_diffraction_lamp()
    nothing_added()


def test_a_place_without_a_grating(scene, carrier):
    bpy.ops.mesh.primitive_plane_add()
    plain = bpy.context.object
    assert not bpy.ops.grating.add_diffraction_lamp.poll()
    plain.data.materials.append(bpy.data.materials.new("Plain"))
    plain.data.materials.append(carrier.active_material)
    assert bpy.ops.grating.add_diffraction_lamp.poll()
    with pytest.raises(RuntimeError, match="no grating at that place"):
        bpy.ops.grating.add_diffraction_lamp()
    nothing_added()
    plain.data.polygons[0].material_index = 1
    assert bpy.ops.grating.add_diffraction_lamp() == {"FINISHED"}


def test_edit_mode_is_refused(carrier):
    bpy.ops.object.mode_set(mode="EDIT")
    assert not bpy.ops.grating.add_diffraction_lamp.poll()
    bpy.ops.object.mode_set(mode="OBJECT")


def test_undo_takes_it_away(carrier):
    bpy.ops.ed.undo_push(message="Before")
    bpy.ops.grating.add_diffraction_lamp()
    bpy.ops.ed.undo_push(message="Added")
    bpy.ops.ed.undo()
    nothing_added()
    assert bpy.data.objects["Plane"].active_material.name == "Diffraction waves"
    bpy.ops.ed.redo()
    assert added().parent == bpy.data.objects["Plane"]


def test_the_menu_has_it(extension):
    assert any(entry.__name__ == "menu_entry" for entry in bpy.types.VIEW3D_MT_light_add.draw._draw_funcs)


def test_command(addon, scene, carrier, tmp_path, capfd):
    blend = tmp_path / "lamp.blend"
    line = ["diffraction-lamp", "--object", "Plane", "--near", "0.5", "-0.25", "3", "--size-mm", "4", "--lit-by", "Sun"]
    assert addon.commands.execute([*line, "--save", str(blend)]) == 0
    assert "throws the colours of Sun" in capfd.readouterr().out
    assert blend.is_file()
    np.testing.assert_allclose(added().matrix_world.translation, (0.5, -0.25, 2e-4), atol=1e-6)


@pytest.mark.parametrize(("change", "told"), [
    (["--object", "Nobody"], "Nobody: no mesh of the scene with a grating"),
    (["--object", "Sun"], "Sun: no mesh of the scene with a grating"),
    (["--lit-by", "Moon"], "Moon: no lamp of the scene"),
    (["--size-mm", "nan"], "--size-mm"),
    (["--near", "1", "2", "inf"], "--near"),
])  # fmt: skip
def test_command_faults_are_one_line(addon, carrier, tmp_path, capfd, change, told):
    line = ["diffraction-lamp", "--object", "Plane", "--save", str(tmp_path / "lamp.blend"), *change]
    capfd.readouterr()
    assert addon.commands.execute(line) != 0
    errors = [each for each in capfd.readouterr().err.splitlines() if each.startswith("error:")]
    assert len(errors) == 1 and told in errors[0]
    nothing_added()
    assert list(tmp_path.iterdir()) == []


def test_its_drivers_need_no_extension(carrier):
    """They are simple expressions of the lamp's own values, which Blender evaluates with scripts off."""
    bpy.ops.grating.add_diffraction_lamp()
    diffraction_lamp = added()
    curves = diffraction_lamp.animation_data.drivers
    assert curves and all(curve.driver.is_simple_expression for curve in curves)
    assert {v.targets[0].id.name for c in curves for v in c.driver.variables} == {"Sun", diffraction_lamp.name}
