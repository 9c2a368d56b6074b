# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene needs of a bake: measured through its camera, written, and refused in one line."""

import json
import math

import bpy
import numpy as np
import pytest

from tests.addon.batch.test_commands import fault

# The margin of the needs (precompute/bake/shown_directions.py), and their rounding outwards to four digits.
MARGIN, DIGITS = 0.02, 1e-4


def ranges(needs):
    return np.array((*needs.region, needs.w))


@pytest.fixture(autouse=True)
def _few_rays(addon, monkeypatch):
    """A ray for every fourth pixel of a frame, and fewer for each of several."""
    monkeypatch.setattr(addon.baking, "_RAYS", 3600)
    monkeypatch.setattr(addon.baking, "_RAYS_LEAST", 300)


def test_a_plane_under_a_sun(addon, scene, watched):
    """wi is (sin 40, 0, cos 40). The camera sees all of the plane's height and more than its width: wr leans by up to
    atan(1 / 10) each way. A pixel is 1/160 of a sensor of 36 mm before a lens of 50 mm."""
    measured = addon.baking.measure_needs(scene, scene.natural_gratings.active())
    lean = 1 / math.sqrt(101)
    corner = 1 / math.sqrt(102)
    sine, cosine = math.sin(math.radians(40)), math.cos(math.radians(40))
    wanted = [(sine - lean, sine + lean), (-lean, lean), (cosine + 10 * corner, cosine + 1)]
    found = ranges(measured.needs)
    # Rays pass through the centres of every second pixel each way, which are 0.0045 of (u, v) wide.
    np.testing.assert_allclose(found, wanted + np.array((-MARGIN, MARGIN)), atol=0.01)
    # At the corner the pixel is narrower by the cosine squared, 0.96; along the slant by another cosine.
    pixel = 36 / 50 / 160
    assert 0.97 * pixel < measured.needs.footprint < pixel
    assert measured.needs.light_radius == 0
    assert measured.facts["light_share"] >= 0.999 and measured.facts["frames"] == [1]
    assert measured.facts["lights"] == "lamps" and measured.facts["objects"] == ["Plane"]
    assert measured.lines[0].startswith("waves: the scene needs u 0.5") and len(measured.lines) == 1


def test_scales_and_turns_are_the_material_s_and_the_object_s(addon, scene, watched):
    grating = scene.natural_gratings.active()
    before = ranges(addon.baking.measure_needs(scene, grating).needs)
    (node,) = addon.material.diffraction_nodes(watched.active_material)
    node.inputs["Rotation"].default_value = math.pi / 2
    node.inputs["Period Scale"].default_value = 0.5
    node.inputs["Height Scale"].default_value = 0.5
    bpy.context.view_layer.update()
    after = ranges(addon.baking.measure_needs(scene, grating).needs)
    # T is now +Y and B is -X; the ranges are rounded outwards, and each margin stays.
    inner = before + np.array((MARGIN, -MARGIN))
    wanted = 0.5 * np.stack([inner[1], -inner[0][::-1], inner[2]]) + np.array((-MARGIN, MARGIN))
    np.testing.assert_allclose(after, wanted, atol=2 * DIGITS)


def test_light_from_everywhere_needs_the_hemisphere(addon, scene, watched):
    bpy.ops.grating.lights(lights="REST")
    measured = addon.baking.measure_needs(scene, scene.natural_gratings.active())
    lean = 1 / math.sqrt(101)
    found = ranges(measured.needs)
    np.testing.assert_allclose(found[:2], np.array((-1, 1)) * (1 + lean + MARGIN) * np.ones((2, 1)), atol=0.01)
    assert measured.facts["lights"] == "everywhere" and measured.needs.light_radius == 0


def test_links_keep_every_direction(addon, scene, watched):
    tree = watched.active_material.node_tree
    (node,) = addon.material.diffraction_nodes(watched.active_material)
    bump = tree.nodes.new("ShaderNodeBump")
    tree.links.new(bump.outputs["Normal"], node.inputs["Normal"])
    measured = addon.baking.measure_needs(scene, scene.natural_gratings.active())
    assert measured.needs.everything and "Plane: nodes set its Normal, so every direction is kept" in measured.lines


def test_a_camera_that_moves_is_looked_through_in_all_frames(addon, scene, watched):
    grating = scene.natural_gratings.active()
    still = addon.baking.measure_needs(scene, grating)
    camera = scene.camera
    for frame, x in ((1, 0.0), (24, 3.0)):
        camera.location.x = x
        camera.keyframe_insert("location", frame=frame)
    scene.frame_set(7)
    moving = addon.baking.measure_needs(scene, grating)
    assert len(moving.facts["frames"]) == addon.baking.FRAMES_MAX
    assert (moving.facts["frames"][0], moving.facts["frames"][-1]) == (1, 24)
    assert scene.frame_current == 7
    assert moving.needs.region.u[1] > still.needs.region.u[1] + 0.2
    assert addon.baking.measure_needs(scene, grating, (1, 1)).needs == still.needs


def test_a_camera_that_a_marker_brings_is_looked_through(addon, scene, watched):
    """Even a camera that is active only between two sampled frames."""
    grating = scene.natural_gratings.active()
    still = addon.baking.measure_needs(scene, grating)
    second = bpy.data.objects.new("Second", scene.camera.data)
    second.matrix_world = scene.camera.matrix_world
    second.location.x += 3.0
    scene.collection.objects.link(second)
    scene.frame_end = 240
    for frame, camera in ((1, scene.camera), (100, second), (103, scene.camera)):
        scene.timeline_markers.new(str(frame), frame=frame).camera = camera
    cut = addon.baking.measure_needs(scene, grating)
    assert {1, 100, 103, 240} <= set(cut.facts["frames"])
    assert cut.needs.region.u[1] > still.needs.region.u[1] + 0.2
    assert set(addon.baking.measure_needs(scene, grating, (90, 110)).facts["frames"]) >= {90, 100, 103, 110}


def test_a_material_that_is_animated_is_looked_at_in_all_frames(addon, scene, watched):
    grating = scene.natural_gratings.active()
    (node,) = addon.material.diffraction_nodes(watched.active_material)
    for frame, turn in ((1, 0.0), (24, 1.5)):
        node.inputs["Rotation"].default_value = turn
        node.inputs["Rotation"].keyframe_insert("default_value", frame=frame)
    assert len(addon.baking.measure_needs(scene, grating).facts["frames"]) == addon.baking.FRAMES_MAX


def test_instances_of_other_meshes_are_no_places(addon, scene, watched):
    """A ray that hits an instance returns a face number of another mesh."""
    grating = scene.natural_gratings.active()
    before = addon.baking.measure_needs(scene, grating)
    tree = bpy.data.node_groups.new("Warts", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    nodes, links = tree.nodes, tree.links
    start, end = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    sphere = nodes.new("GeometryNodeMeshIcoSphere")
    sphere.inputs["Radius"].default_value, sphere.inputs["Subdivisions"].default_value = 0.3, 5
    instances, join = nodes.new("GeometryNodeInstanceOnPoints"), nodes.new("GeometryNodeJoinGeometry")
    links.new(start.outputs[0], instances.inputs["Points"])
    links.new(sphere.outputs["Mesh"], instances.inputs["Instance"])
    links.new(instances.outputs[0], join.inputs[0])
    links.new(start.outputs[0], join.inputs[0])
    links.new(join.outputs[0], end.inputs[0])
    watched.modifiers.new("Warts", "NODES").node_group = tree
    bpy.context.view_layer.update()
    found = addon.baking.measure_needs(scene, grating, (1, 1))
    assert 0 < found.facts["places"] < before.facts["places"]


def test_subdivision_is_evaluated_and_objects_before_it_hide_it(addon, scene, watched):
    """A subdivided cube is round; a cube behind another object shows nothing, unless no render shows that object."""
    grating = scene.natural_gratings.active()
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 1))
    cube = bpy.context.object
    cube.data.materials.append(watched.active_material)
    bpy.data.objects["Plane"].hide_render = True
    before = ranges(addon.baking.measure_needs(scene, grating).needs)
    cube.modifiers.new("round", "SUBSURF").levels = 3
    for polygon in cube.data.polygons:
        polygon.use_smooth = True
    bpy.context.view_layer.update()
    after = ranges(addon.baking.measure_needs(scene, grating).needs)
    assert np.ptp(after[0]) > np.ptp(before[0]) + 0.5
    bpy.ops.mesh.primitive_plane_add(size=5, location=(0, 0, 5))
    bpy.context.view_layer.update()
    with pytest.raises(addon.child.GratingError, match="the camera sees nothing of it"):
        addon.baking.measure_needs(scene, grating)
    bpy.context.object.hide_render = True
    np.testing.assert_array_equal(ranges(addon.baking.measure_needs(scene, grating).needs), after)


def test_a_scene_that_shows_nothing_is_told_in_one_line(addon, scene, watched):
    grating = scene.natural_gratings.active()

    def told():
        with pytest.raises(addon.child.GratingError) as fault:
            addon.baking.measure_needs(scene, grating)
        assert len(str(fault.value).splitlines()) == 1 and "; " in str(fault.value)
        return str(fault.value)

    bpy.data.objects["Sun"].rotation_euler = (math.radians(100), 0, 0)
    bpy.context.view_layer.update()
    assert "waves: no lamp lights what the camera sees of it" in told()
    scene.camera.rotation_euler = (math.pi, 0, 0)
    bpy.context.view_layer.update()
    assert "waves: the camera sees nothing of it; turn the camera to Plane" in told()
    camera, scene.camera = scene.camera, None
    assert "no camera" in told()
    scene.camera = camera
    watched.data.materials.clear()
    assert "waves: no mesh of the scene shows it" in told()


def test_the_verb_writes_a_file_that_a_bake_reads(addon, scene, watched, tmp_path):
    path, report = tmp_path / "needs.json", tmp_path / "report.json"
    assert addon.commands.execute(["needs", "-o", str(path), "--json", str(report), "--frames", "1", "1"]) == 0
    record = json.loads(path.read_text())
    assert record == json.loads(report.read_text())["needs"]
    assert record["measured"]["margin"] == MARGIN and record["measured"]["light_share"] >= 0.999
    bake = ["bake", "sample:cd", "--delta-e", "5", "--coherence-um", "5", "--needs", str(path), "-o", str(tmp_path)]
    assert addon.commands.execute([*bake, "--save", str(tmp_path / "a.blend")]) == 0
    baked = scene.natural_gratings.items[-1].bake_request().needs
    np.testing.assert_allclose(ranges(baked), [record[name] for name in "uvw"])


def test_the_verb_s_faults_are_one_line(addon, scene, watched, tmp_path, capfd):
    path = tmp_path / "needs.json"
    assert "neither -o nor --bake" in fault(capfd, addon, "needs")
    assert "no such grating; there are waves" in fault(capfd, addon, "needs", "-o", path, "--grating", "nobody")
    assert "the last comes before the first" in fault(capfd, addon, "needs", "-o", path, "--frames", 3, 1)
    assert "a height map" in fault(capfd, addon, "needs", "--bake")
    scene.camera = None
    assert "no camera" in fault(capfd, addon, "needs", "-o", path)
    assert list(tmp_path.iterdir()) == []
