# SPDX-License-Identifier: GPL-3.0-or-later
"""Comb Grating: what it stores, follows, reports and refuses, and its undo."""

import os

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from tests.addon.conftest import reports, select

COMB = ("Grating", "grating_comb")


@pytest.fixture
def monkey(scene):
    """Suzanne, turned and moved, selected alone."""
    bpy.ops.mesh.primitive_monkey_add(location=(1, 2, 3), rotation=(0.3, 0.4, 0.5))
    select(bpy.context.object)
    return bpy.context.object


@pytest.fixture
def tube(scene):
    """An open tube of ten metres along its own Z, without a UV map; moved, and lying along the scene's X."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=24, radius=0.5, depth=10, end_fill_type="NOTHING", calc_uvs=False)
    made = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide(number_cuts=7)
    bpy.ops.object.mode_set(mode="OBJECT")
    made.matrix_world = Matrix.Translation((0, 0, 5)) @ Matrix.Rotation(np.pi / 2, 4, "Y")
    bpy.context.view_layer.update()
    select(made)
    return made


def combed(thing, addon) -> np.ndarray:
    """The stored directions in the middle of each triangle (m, 3), in the object's space."""
    mesh = thing.data
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    source = addon.direction_source.DirectionSource()
    shares = np.full((count, 3), 1 / 3)
    return addon.tangents.frame_field(mesh, np.arange(count), shares=shares, source=source).tangents


def is_bare(thing) -> bool:
    return COMB[0] not in thing.data.uv_layers and COMB[1] not in thing.data.attributes


def faults(fault, **settings) -> None:
    """Assert that the operator refuses with one line that matches `fault`."""
    with pytest.raises(RuntimeError, match=fault) as caught:
        bpy.ops.grating.comb(**settings)
    assert len(str(caught.value).strip().splitlines()) == 1


@pytest.mark.short("TAIL", "UV", "SMOOTHEST")
@pytest.mark.parametrize("source", ["TAIL", "X", "Y", "Z", "UV", "SMOOTHEST"])
def test_suzanne_is_combed(monkey, capfd, source):
    maps = [layer.name for layer in monkey.data.uv_layers]
    told = reports(lambda: bpy.ops.grating.comb(source=source), capfd)
    assert "Suzanne: combed by" in told and "singular point" in told
    assert [layer.name for layer in monkey.data.uv_layers] == [*maps, COMB[0]]
    assert monkey.data.uv_layers.active.name == maps[0] and monkey.data.uv_layers[maps[0]].active_render
    turn = np.empty(len(monkey.data.loops) * 3, np.float32)
    monkey.data.attributes[COMB[1]].data.foreach_get("vector", turn)
    np.testing.assert_allclose(np.linalg.norm(turn.reshape(-1, 3), axis=1), 1, atol=1e-6)
    # The head and two eyes: three closed parts with two singular points each.
    selected = sum(vertex.select for vertex in monkey.data.vertices)
    assert selected >= 3 or "no singular" in told


def test_the_field_is_in_the_objects_space(tube, addon, capfd):
    told = reports(lambda: bpy.ops.grating.comb(source="Z"), capfd)
    assert "combed by Z Axis; no singular points" in told
    assert combed(tube, addon)[:, 2].min() > 0.999


def test_head_to_tail_needs_no_uv_map(tube, addon):
    assert not tube.data.uv_layers
    bpy.ops.grating.comb(source="TAIL")
    along = np.abs(combed(tube, addon)[:, 2])
    assert np.median(along) > 0.99


def curve(points, kind="POLY"):
    """A selected curve through points of the scene's space."""
    data = bpy.data.curves.new("Stroke", "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new(kind)
    if kind == "BEZIER":
        spline.bezier_points.add(len(points) - 1)
        for knot, point in zip(spline.bezier_points, points, strict=True):
            knot.co = knot.handle_left = knot.handle_right = point
    else:
        spline.points.add(len(points) - 1)
        for knot, point in zip(spline.points, points, strict=True):
            knot.co = (*point, 1)
    made = bpy.data.objects.new("Stroke", data)
    bpy.context.scene.collection.objects.link(made)
    made.select_set(True)
    return made


def pencil(points):
    """A selected Grease Pencil stroke."""
    datas = bpy.data.grease_pencils_v3 if hasattr(bpy.data, "grease_pencils_v3") else bpy.data.grease_pencils
    data = datas.new("Pencil")
    drawing = data.layers.new("Lines").frames.new(bpy.context.scene.frame_current).drawing
    drawing.add_strokes([len(points)])
    for made, point in zip(drawing.strokes[0].points, points, strict=True):
        made.position = point
    made = bpy.data.objects.new("Pencil", data)
    bpy.context.scene.collection.objects.link(made)
    made.select_set(True)
    return made


def hair(points):
    """A selected hair."""
    data = bpy.data.hair_curves.new("Hair")
    data.add_curves([2, len(points)])
    flat = np.array([points[0], points[1], *points], np.float32)
    data.attributes["position"].data.foreach_set("vector", flat.ravel())
    made = bpy.data.objects.new("Hair", data)
    bpy.context.scene.collection.objects.link(made)
    made.select_set(True)
    return made


# On top of the tube, which lies along X at a height of 5, drawn against X. The tube's own Z is the scene's X.
DRAWN = [(3.0, 0.0, 5.5), (2.0, 0.0, 5.5), (0.0, 0.0, 5.5)]


@pytest.mark.parametrize(("draw", "source"), [
    (curve, "STROKES"), (lambda points: curve(points, "BEZIER"), "STROKES"), (pencil, "STROKES"), (hair, "HAIR"),
])  # fmt: skip
def test_it_follows_what_is_drawn_on_it(tube, addon, draw, source):
    draw(DRAWN)
    bpy.context.view_layer.update()
    assert bpy.ops.grating.comb(source=source) == {"FINISHED"}
    assert combed(tube, addon)[:, 2].max() < -0.99


def test_annotations_are_strokes(tube, addon):
    if not hasattr(bpy.data, "annotations"):
        pytest.skip("a script cannot draw annotations before Blender 5.0")
    annotation = bpy.data.annotations.new("Notes")
    stroke = annotation.layers.new("Note").frames.new(1).strokes.new()
    stroke.points.add(len(DRAWN))
    for made, point in zip(stroke.points, DRAWN, strict=True):
        made.co = point
    bpy.context.scene.annotation = annotation
    try:
        bpy.ops.grating.comb(source="STROKES")
    finally:
        bpy.context.scene.annotation = None
    assert combed(tube, addon)[:, 2].max() < -0.99


def test_it_follows_the_bones_of_its_armature(tube, addon):
    bpy.ops.object.armature_add()
    armature = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.data.edit_bones[0]
    bone.head, bone.tail = (5, 0, 5), (-5, 0, 5)
    bpy.ops.object.mode_set(mode="OBJECT")
    select(tube)
    faults("no bones", source="BONES")
    tube.modifiers.new("Armature", "ARMATURE").object = armature
    bpy.ops.grating.comb(source="BONES")
    assert combed(tube, addon)[:, 2].max() < -0.999


def test_combing_again_replaces_the_field(tube, addon):
    bpy.ops.grating.comb(source="Z")
    tube.data.attributes.remove(tube.data.attributes[COMB[1]])
    tube.data.attributes.new(COMB[1], "FLOAT_VECTOR", "CORNER")
    bpy.ops.grating.comb(source="SMOOTHEST")
    bpy.ops.grating.comb(source="Z")
    assert combed(tube, addon)[:, 2].min() > 0.999
    assert len(tube.data.uv_layers) == 1


@pytest.mark.night("test_undo_takes_the_field_away")
def test_a_combed_mesh_is_assigned_without_a_warning_of_seams(monkey, grating, capfd):
    assert "UV" in reports(bpy.ops.grating.assign, capfd)
    bpy.ops.grating.comb(source="X")
    assert "UV" not in reports(bpy.ops.grating.assign, capfd)


def test_undo_takes_the_field_away(monkey):
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.grating.comb(source="X")
    bpy.ops.ed.undo_push(message="combed")
    bpy.ops.ed.undo()
    assert is_bare(bpy.data.objects["Suzanne"])
    bpy.ops.ed.redo()
    assert not is_bare(bpy.data.objects["Suzanne"])


def test_what_cannot_be_combed_is_told_and_nothing_changes(monkey, tmp_path):
    mesh = monkey.data
    faults("Suzanne: no strokes; draw", source="STROKES")
    faults("Suzanne: no hair", source="HAIR")
    faults("Suzanne: no bones", source="BONES")
    bpy.ops.object.mode_set(mode="EDIT")
    faults("Switch to Object Mode first", source="X")
    bpy.ops.object.mode_set(mode="OBJECT")
    while len(mesh.uv_layers) < 8:
        mesh.uv_layers.new()
    faults("has 8 UV maps", source="X")
    mesh.uv_layers.remove(mesh.uv_layers[-1])
    mesh.uv_layers[-1].name = "Grating"
    faults("a UV map Grating of its own", source="X")
    mesh.uv_layers.remove(mesh.uv_layers[-1])
    assert is_bare(monkey)


def test_flat_and_empty_meshes_are_refused(scene):
    empty = bpy.data.objects.new("Empty", bpy.data.meshes.new("Empty"))
    line = bpy.data.meshes.new("Line")
    line.from_pydata([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [], [(0, 1, 2)])
    flat = bpy.data.objects.new("Flat", line)
    for thing, fault in ((empty, "Empty: no faces"), (flat, "Flat: its faces have no area")):
        scene.collection.objects.link(thing)
        select(thing)
        faults(fault, source="TAIL")
        assert is_bare(thing)
    plane = bpy.data.objects["Plane"]
    while plane.data.uv_layers:
        plane.data.uv_layers.remove(plane.data.uv_layers[0])
    select(plane)
    faults("Plane: no UV map", source="UV")


@pytest.mark.night("test_undo_takes_the_field_away")
def test_of_several_meshes_all_are_combed_or_none(monkey, scene):
    line = bpy.data.meshes.new("Line")
    line.from_pydata([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [], [(0, 1, 2)])
    flat = bpy.data.objects.new("Flat", line)
    scene.collection.objects.link(flat)
    flat.select_set(True)
    faults("Flat: its faces have no area", source="X")
    assert is_bare(monkey)
    flat.select_set(False)
    bpy.data.objects["Plane"].select_set(True)
    bpy.ops.grating.comb(source="X")
    assert not is_bare(monkey) and not is_bare(bpy.data.objects["Plane"])


def test_a_mesh_that_changed_meanwhile_is_left_alone(monkey, scene, addon):
    job = addon.combing.start_comb(scene, [monkey], "X")
    job.wait()
    monkey.data.clear_geometry()
    with pytest.raises(Exception, match="changed while it was combed"):
        addon.combing.finish_comb(job)
    assert is_bare(monkey)


def test_a_cancelled_comb_leaves_nothing(monkey, scene, addon):
    job = addon.combing.start_comb(scene, [monkey], "SMOOTHEST")
    held = job._private.name
    job.cancel()
    assert not job.running and not os.path.exists(held) and is_bare(monkey)


def test_it_is_a_verb(monkey, addon, tmp_path, capfd):
    path = tmp_path / "combed.blend"
    given = ["comb", "--object", "Suzanne", "--source", "axis", "--axis", "y", "--save", str(path)]
    assert addon.commands.execute(given) == 0
    assert "Suzanne: combed by Y Axis" in capfd.readouterr().out and path.is_file()
    assert addon.commands.execute(["comb", "--object", "Suzanne", "--source", "strokes"]) != 0
    assert "error: Suzanne: no strokes" in capfd.readouterr().err
