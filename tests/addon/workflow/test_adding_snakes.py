# SPDX-License-Identifier: GPL-3.0-or-later
"""Add > Mesh > Snake: the mesh and its skins, along a curve, with bones, undo, and refusals."""

import bpy
import numpy as np
import pytest

from tests.addon.conftest import reports, select


def read(collection, name: str, width: int, dtype=np.float32) -> np.ndarray:
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)


def add(**settings):
    """Add a snake, of 50,000 faces by default."""
    assert bpy.ops.grating.add_snake(**{"faces": 50_000, **settings}) == {"FINISHED"}
    return bpy.context.active_object


def test_a_snake_is_added_at_the_cursor_selected_and_on_the_floor(scene):
    scene.cursor.location = (1, 2, 3)
    try:
        snake = add(length_m=0.8)
    finally:
        scene.cursor.location = (0, 0, 0)
    assert bpy.context.selected_objects == [snake]
    assert snake.location[:] == (1, 2, 3)
    co = read(snake.data.vertices, "co", 3)
    # The belly's plates are curved, so only their rims' rise is below the floor: fractions of a millimetre.
    assert co[:, 2].min() == pytest.approx(0, abs=5e-4)
    assert abs(co[:, :2].min(axis=0) + co[:, :2].max(axis=0)).max() < 0.02
    assert not snake.data.copy().validate(), "Blender had to repair the mesh"


def test_it_has_about_as_many_faces_as_asked_for(scene):
    snake = add(faces=200_000)
    assert len(snake.data.polygons) == pytest.approx(200_000, rel=0.05)


def test_plates_are_smooth_and_end_in_creases(scene):
    mesh = add(faces=200_000).data
    assert read(mesh.polygons, "use_smooth", 1, bool).all()
    normals = read(mesh.corner_normals, "vector", 3)
    face = read(mesh.polygons, "normal", 3)
    size = read(mesh.polygons, "loop_total", 1, np.int32)[:, 0]
    rim = read(mesh.attributes["scale_rim"].data, "value", 1)[:, 0]
    corner_rim = rim[read(mesh.loops, "vertex_index", 1, np.int32)[:, 0]]
    start = read(mesh.polygons, "loop_start", 1, np.int32)[:, 0]
    turn = np.degrees(np.arccos(np.clip((normals * np.repeat(face, size, axis=0)).sum(axis=1), -1, 1)))
    inner = np.maximum.reduceat(corner_rim, start) == 0
    # If the grooves' walls, tens of degrees steep, were averaged in, the plates' rims would be rounded.
    worst = np.maximum.reduceat(turn, start)[inner]
    assert np.median(worst) < 8
    sharp = read(mesh.attributes["sharp_edge"].data, "value", 1, bool)[:, 0]
    assert 0.05 < sharp.mean() < 0.4


def test_attributes_reach_the_mesh(scene):
    mesh = add().data
    domains = {"scale_rim": "POINT", "along": "POINT", "around": "POINT", "scale_random": "FACE", "belly": "FACE"}
    for name, domain in domains.items():
        assert mesh.attributes[name].domain == domain
        values = read(mesh.attributes[name].data, "value", 1)
        assert (values.min(), values.max()) == pytest.approx((0, 1), abs=2e-3)
    assert [material.name for material in mesh.materials] == ["Xenopeltis Skin", "Snake Eye"]
    assert (np.unique(read(mesh.polygons, "material_index", 1, np.int32)) == (0, 1)).all()


@pytest.mark.parametrize("species", ["XENOPELTIS", "ELAPHE"])
def test_diffraction_goes_over_a_skin_and_keeps_its_base(addon, scene, grating, species):
    snake = add(species=species)
    skin = snake.data.materials[0]
    (base,) = [node for node in skin.node_tree.nodes if node.type == "BSDF_PRINCIPLED"]
    assert base.inputs["Base Color"].is_linked
    addon.assigning.add_to_meshes(scene, [snake])
    (node,) = addon.material.diffraction_nodes(skin)
    assert node.inputs["Base"].links[0].from_node == base
    assert snake.data.materials[0] == skin


@pytest.mark.parametrize("faces", [50_000, 200_000])
@pytest.mark.parametrize("species", ["XENOPELTIS", "ELAPHE"])
def test_u_keeps_its_direction_over_the_cut_of_the_map(addon, scene, species, faces):
    """With fewer faces the very snout has too few triangles."""
    assert not addon.seams.Seams(add(species=species, faces=faces).data).turned.any()


def test_a_snake_lies_along_the_active_curve_and_is_as_long(scene):
    curve = bpy.data.curves.new("Line", "CURVE")
    curve.dimensions = "3D"
    for points in (((0, 0, 0), (1, 0, 0), (2, 0.3, 0)), ((5, 5, 5), (9, 9, 9))):
        spline = curve.splines.new("POLY")
        spline.points.add(len(points) - 1)
        for point, place in zip(spline.points, points, strict=True):
            point.co = (*place, 1)
    line = bpy.data.objects.new("Line", curve)
    scene.collection.objects.link(line)
    line.location = (0, 0, 1)
    select(line)
    snake = add(pose="CURVE")
    co = read(snake.data.vertices, "co", 3)
    length = 1 + np.hypot(1, 0.3)
    assert np.ptp(co[:, 0]) == pytest.approx(2, abs=0.1)
    assert co[:, 2].min() == pytest.approx(1, abs=2e-3)
    # 80 half widths long.
    assert np.ptp(co[:, 2]) == pytest.approx(length / 80 * (0.88 + 0.66), rel=0.05)
    assert co[:, 0].max() < 2.1  # not along the second spline


def test_without_a_curve_it_is_refused_and_nothing_changes(scene):
    objects = set(bpy.data.objects)
    with pytest.raises(RuntimeError, match="Plane: no curve to lay the snake along; make a curve the active object"):
        bpy.ops.grating.add_snake(pose="CURVE")
    assert set(bpy.data.objects) == objects and "Snake" not in bpy.data.meshes


def test_a_curve_without_length_is_refused(scene):
    curve = bpy.data.curves.new("Dot", "CURVE")
    curve.splines.new("POLY")
    dot = bpy.data.objects.new("Dot", curve)
    scene.collection.objects.link(dot)
    select(dot)
    with pytest.raises(RuntimeError, match="its line has no length"):
        bpy.ops.grating.add_snake(pose="CURVE")
    assert "Snake" not in bpy.data.objects


@pytest.mark.parametrize("kind", ["add_snake", "add_shed_skin"])
def test_into_a_hidden_collection_it_is_refused(scene, kind):
    collection = bpy.data.collections.new("Away")
    scene.collection.children.link(collection)
    view = bpy.context.view_layer
    layer, before = view.layer_collection.children["Away"], view.active_layer_collection
    layer.hide_viewport = True
    view.update()  # activates another collection
    view.active_layer_collection = layer
    try:
        with pytest.raises(RuntimeError, match="Away: the active collection is hidden; show it, or choose another"):
            getattr(bpy.ops.grating, kind)(faces=11_000)
    finally:
        view.active_layer_collection = before
        bpy.data.collections.remove(collection)
    assert not set(bpy.data.objects.keys()) - {"Plane", "Sun"}


def test_an_opened_file_s_own_collection_is_not_hidden(scene, tmp_path):
    """Blender 5.3 says that it is if the file has objects in no other."""
    bpy.data.batch_remove(list(bpy.data.collections))
    file = str(tmp_path / "own.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    assert bpy.ops.grating.add_shed_skin(faces=11_000) == {"FINISHED"}
    assert "Shed Skin" in bpy.context.scene.collection.objects


@pytest.mark.parametrize("length_m", [0.0, 1e6, float("nan")])
def test_a_length_out_of_range_is_refused(addon, scene, length_m):
    with pytest.raises(Exception, match="give 0.01 to 100"):
        addon.adding_things.add_snake(
            bpy.context, "XENOPELTIS", "S", length_m=length_m, detail=addon.shape.Detail(11_000), bones=False
        )  # fmt: skip
    assert "Snake" not in bpy.data.objects


def test_the_report_tells_the_faces_and_the_length(scene, capfd):
    told = reports(lambda: bpy.ops.grating.add_snake(faces=11_000, length_m=0.5), capfd)
    assert "Snake: 11,000 faces, 0.5 m long" in told


def test_bones_move_the_mesh_and_leave_it_at_rest(scene):
    still = read(add().data.vertices, "co", 3)
    snake = add(bones=True)
    (modifier,) = snake.modifiers
    armature = modifier.object
    assert bpy.context.active_object == snake and snake.parent == armature
    bpy.context.view_layer.update()

    def posed():
        graph = bpy.context.evaluated_depsgraph_get()
        return read(snake.evaluated_get(graph).data.vertices, "co", 3)

    # float32 keeps 3e-8 m of half a metre; a few bones' products add to that.
    np.testing.assert_allclose(posed(), still, atol=1e-6)
    neck = armature.pose.bones["Spine 04"]
    neck.rotation_mode = "XYZ"
    neck.rotation_euler = (0.3, 0, 0)
    bpy.context.view_layer.update()
    moved = np.linalg.norm(posed() - still, axis=1)
    along = read(snake.data.attributes["along"].data, "value", 1)[:, 0]
    # A bone is a 32nd of the snake; it moves everything ahead of it, and its neighbour behind moves half as far.
    assert moved[along < 0.05].min() > 1e-3
    assert moved[along > 6 / 32].max() < 1e-6
    groups = [sum(each.weight for each in vertex.groups) for vertex in list(snake.data.vertices)[::97]]
    assert groups == pytest.approx([1] * len(groups), abs=1e-6)


def test_a_piece_of_shed_skin_is_a_flat_sheet_that_lets_light_through(addon, scene, grating, capfd):
    told = reports(lambda: bpy.ops.grating.add_shed_skin(size_mm=60, faces=50_000), capfd)
    shed = bpy.context.active_object
    assert f"Shed Skin: {len(shed.data.polygons):,} faces" in told
    co = read(shed.data.vertices, "co", 3)
    assert np.ptp(co[:, 0]) == pytest.approx(0.06, rel=0.15)
    assert np.ptp(co[:, 1]) == pytest.approx(0.06, rel=0.01)
    assert co[:, 2].min() == pytest.approx(0, abs=1e-9)
    assert np.ptp(co[:, 2]) < 0.004
    assert not shed.data.copy().validate(), "Blender had to repair the mesh"
    assert not addon.seams.Seams(shed.data).turned.any()
    addon.assigning.add_to_meshes(scene, [shed])
    (node,) = addon.material.diffraction_nodes(shed.data.materials[0])
    base = node.inputs["Base"].links[0].from_node
    assert {link.from_node.type for link in (base.inputs[1].links[0], base.inputs[2].links[0])} == {
        "BSDF_TRANSPARENT", "BSDF_PRINCIPLED",
    }  # fmt: skip


@pytest.mark.parametrize("size_m", [0.0, 11.0, float("nan")])
def test_a_size_of_shed_skin_out_of_range_is_refused(addon, scene, size_m):
    with pytest.raises(Exception, match="mm; give 0.1 to 10000"):
        addon.adding_things.add_shed_skin(bpy.context, "ELAPHE", size_m=size_m, faces=11_000, seed=0)
    assert "Shed Skin" not in bpy.data.objects


@pytest.mark.parametrize("kind", ["add_snake", "add_shed_skin"])
def test_it_is_undone(scene, kind):
    bpy.ops.ed.undo_push(message="before")
    before = {obj.name for obj in bpy.data.objects}
    getattr(bpy.ops.grating, kind)(faces=11_000)
    assert len(bpy.data.objects) == len(before) + 1
    bpy.ops.ed.undo_push(message="added")
    bpy.ops.ed.undo()
    assert {obj.name for obj in bpy.data.objects} == before


def test_the_menu_has_its_entry(extension):
    entries = bpy.types.VIEW3D_MT_mesh_add.draw._draw_funcs
    assert any(entry.__module__.endswith("operators.add_things") for entry in entries)


def pictured(scene, snake, height: float) -> np.ndarray:
    """Linear colours (n, 3) of the pixels that show the snake, seen along Z from `height` in even light."""
    for lamp in [obj for obj in scene.objects if obj != snake]:
        bpy.data.objects.remove(lamp)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 0.5
    camera.location = (0, 0, height)
    camera.rotation_euler = (0 if height > 0 else np.pi, 0, 0)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("White")
    if bpy.app.version < (5, 0):
        scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 4, False
    scene.render.resolution_x = scene.render.resolution_y = 200
    scene.render.film_transparent = True
    return rendered(scene)


def rendered(scene) -> np.ndarray:
    """The colours (n, 3) of a render's opaque pixels."""
    import tempfile
    from pathlib import Path

    with tempfile.TemporaryDirectory() as folder:
        settings = scene.render.image_settings
        settings.file_format, settings.color_mode = "OPEN_EXR", "RGBA"
        scene.render.filepath = str(Path(folder) / "skin.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
    pixels = pixels.reshape(-1, 4)
    return pixels[pixels[:, 3] > 0.99, :3]


@pytest.mark.parametrize("species", ["XENOPELTIS", "ELAPHE"])
def test_skins_are_brown_above_and_pale_below(scene, species):
    """Under even white light a picture shows the skin's own colours."""
    snake = add(species=species, pose="S", length_m=0.5)
    above = pictured(scene, snake, 1.0)
    below = pictured(scene, snake, -1.0)
    red, green, blue = np.median(above, axis=0)
    assert 0.02 < red < 0.4 and red > 1.5 * green > 1.5 * blue
    assert np.median(below[:, 1]) > 2.5 * np.median(above[:, 1])
    # Saddles are redder than the ground between them; a sunbeam snake has none.
    redness = above[:, 0] / above[:, 1]
    spread = np.quantile(redness, 0.9) / np.quantile(redness, 0.1)
    assert spread > 1.5 if species == "ELAPHE" else spread < 1.35
    # Most of both bellies is pale; at least a tenth of the corn snake's is dark checks.
    assert (np.quantile(below[:, 1], 0.1) < 0.2) == (species == "ELAPHE")
