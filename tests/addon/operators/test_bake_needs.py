# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake of what a scene needs, by button or command: shown, undone, and refused in one line."""

import json
import math

import bpy
import numpy as np
import pytest


def ranges(needs):
    return np.array((*needs.region, needs.w))


@pytest.fixture
def coarse(scene, watched, scan, addon, monkeypatch):
    """The watched plane's grating, baked coarsely from its scan and assigned; few rays measure what the scene needs."""
    monkeypatch.setattr(addon.baking, "_RAYS", 2000)
    scene.natural_gratings.items.clear()
    bpy.data.materials.remove(watched.active_material)
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    grating = scene.natural_gratings.active()
    grating.delta_e, grating.lights = 6.0, "LAMPS"
    bpy.ops.grating.bake()
    bpy.ops.object.select_all(action="DESELECT")
    watched.select_set(True)
    bpy.ops.grating.assign()
    return grating


def shown_pixels(addon, grating):
    """The pixels of the atlas that the grating's materials read, and the names of all images."""
    tree = addon.response.response_in(grating.group).group
    (image,) = {node.image for node in tree.nodes if node.type == "TEX_IMAGE"}
    return image.size[0] * image.size[1], sorted(each.name for each in bpy.data.images)


def test_one_click_measures_bakes_and_swaps(addon, scene, coarse, watched):
    from precompute.table.atlas import read_header

    material, first, before = watched.active_material, coarse.bake_path, shown_pixels(addon, coarse)
    assert bpy.ops.grating.needs() == {"FINISHED"}
    assert watched.active_material == material and coarse.bake_path != first
    after = shown_pixels(addon, coarse)
    assert after[0] < before[0] and after[1] == before[1]
    _, header = read_header(coarse.baked_file())
    asked = addon.baking.measure_needs(scene, coarse).needs
    recorded = header["request"]["needs"]
    np.testing.assert_allclose(ranges(asked), [recorded[name] for name in "uvw"], atol=1e-9)
    assert recorded["footprint"] == asked.footprint and "measured" not in recorded
    assert coarse.for_scene and coarse.bake_summary.splitlines()[-1] == "for this scene only"
    assert coarse.source and coarse.delta_e == 6.0
    np.testing.assert_allclose(ranges(coarse.bake_request().needs), ranges(asked), atol=1e-9)
    assert bpy.ops.grating.needs(everything=True) == {"FINISHED"}
    assert shown_pixels(addon, coarse) == before and not coarse.for_scene
    assert coarse.bake_request().needs.everything


@pytest.mark.night("test_the_button_refuses_in_one_line_and_changes_nothing")
def test_one_undo_brings_the_former_bake_back(addon, scene, coarse):
    first, request, wide = coarse.bake_path, coarse.request, shown_pixels(addon, coarse)
    bpy.ops.ed.undo_push(message="Before")
    bpy.ops.grating.needs()
    narrow = shown_pixels(addon, scene.natural_gratings.active())
    bpy.ops.ed.undo_push(message="Baked")
    assert narrow[0] < wide[0]
    bpy.ops.ed.undo()
    grating = bpy.context.scene.natural_gratings.active()
    assert (grating.bake_path, grating.request, grating.for_scene) == (first, request, False)
    assert shown_pixels(addon, grating) == wide
    bpy.ops.ed.redo()
    grating = bpy.context.scene.natural_gratings.active()
    assert shown_pixels(addon, grating) == narrow and grating.for_scene


def test_the_button_refuses_in_one_line_and_changes_nothing(addon, scene, coarse):
    before = coarse.bake_path, coarse.request, shown_pixels(addon, coarse)
    camera, scene.camera = scene.camera, None
    with pytest.raises(RuntimeError, match="no camera; add one") as told:
        bpy.ops.grating.needs()
    assert len(str(told.value).strip().splitlines()) == 1
    scene.camera = camera
    coarse.coherence_um = 5000
    with pytest.raises(RuntimeError, match="longer than the scan"):
        bpy.ops.grating.needs()
    coarse.coherence_um = 0
    assert (coarse.bake_path, coarse.request, shown_pixels(addon, coarse)) == before


def test_the_verb_bakes_and_saves(addon, scene, coarse, tmp_path):
    path, report = tmp_path / "a.blend", tmp_path / "report.json"
    assert addon.commands.execute(["needs", "--bake", "--save", str(path), "--json", str(report)]) == 0
    assert path.is_file() and coarse.for_scene
    facts = json.loads(report.read_text())
    assert facts["bake"]["files"][0] == coarse.bake_path
    assert facts["needs"]["u"] == pytest.approx(list(coarse.bake_request().needs.region.u))


@pytest.mark.night("test_the_verb_bakes_and_saves")
def test_a_bake_of_a_sample_alone_tells_what_to_bake(addon, scene, watched, tmp_path):
    """The grating that `assign` adds has no height map; its bake's header names the sample."""
    given = ["--delta-e", "9", "--coherence-um", "3"]
    job = addon.child.Job(
        "bake",
        ["sample:cd", *given],
        tmp_path,
        deadline=addon.child.Deadline(600, addon.child.GratingError("", "", "")),
    )
    job.wait()
    bake = job.result()["files"][0]
    assign = ["assign", bake, "--object", "Plane", "--lights", "lamps", "--save", str(tmp_path / "a.blend")]
    assert addon.commands.execute(assign) == 0
    assert bpy.ops.grating.needs() == {"FINISHED"}
    grating = scene.natural_gratings.active()
    assert grating.source == "sample:cd" and grating.for_scene and grating.coherence_um == pytest.approx(3)


@pytest.fixture
def ball(scene, coarse, watched):
    """A ball in place of the plane: it shows nearly all directions."""
    material = watched.active_material
    bpy.data.objects.remove(watched)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32)
    thing = bpy.context.object
    thing.data.materials.append(material)
    for polygon in thing.data.polygons:
        polygon.use_smooth = True
    bpy.ops.grating.lights(lights="REST")
    scene.camera.location, scene.camera.rotation_euler = (10, 0, 0), (math.pi / 2, 0, math.pi / 2)
    bpy.context.view_layer.update()
    return thing


def test_a_ball_has_nothing_to_gain(addon, scene, coarse, ball, capfd, monkeypatch):
    before = coarse.bake_path, coarse.request, shown_pixels(addon, coarse)
    monkeypatch.setattr(addon.child.Job, "__init__", lambda *_, **__: pytest.fail("a bake was started"))
    assert bpy.ops.grating.needs() == {"CANCELLED"}
    assert "waves: nothing to gain: the scene shows 100%" in capfd.readouterr().out
    assert (coarse.bake_path, coarse.request, shown_pixels(addon, coarse)) == before


@pytest.mark.night("test_a_ball_has_nothing_to_gain")
def test_the_verb_says_that_there_is_nothing_to_gain(addon, scene, coarse, ball, tmp_path, capfd):
    report, path = tmp_path / "report.json", coarse.bake_path
    capfd.readouterr()
    assert addon.commands.execute(["needs", "--bake", "--json", str(report)]) == 0
    (line,) = [each for each in capfd.readouterr().err.splitlines() if "nothing to gain" in each]
    assert line.endswith("MiB; the present bake stays")
    facts = json.loads(report.read_text())
    assert facts["nothing_to_gain"] and "bake" not in facts and coarse.bake_path == path


def test_a_bake_that_comes_out_no_smaller_is_not_taken(addon, coarse, monkeypatch):
    before = coarse.bake_path
    result = addon.child.Job.result
    monkeypatch.setattr(addon.child.Job, "result", lambda job: result(job) | {"blender_bytes": 1 << 40})
    with pytest.raises(RuntimeError, match="nothing gained: the bake for this scene takes 1048576 MiB instead of"):
        bpy.ops.grating.needs()
    assert coarse.bake_path == before and not coarse.for_scene


@pytest.mark.night("test_the_verb_bakes_and_saves")
def test_the_estimate_is_that_of_a_bake(addon, scene, coarse, watched):
    """A bake's texels differ by up to 7 % (workflow/baking.py), which is 15 % of its bytes."""
    from precompute.bake.needs import EVERYTHING
    from precompute.bake.plan import expected_table_bytes
    from precompute.table.atlas import read_header

    layout, _ = read_header(coarse.baked_file())
    part, whole = expected_table_bytes(layout, EVERYTHING)
    assert part == pytest.approx(whole, rel=0.02)
    needs = addon.baking.measure_needs(scene, coarse).needs
    part, _ = expected_table_bytes(layout, needs)
    bpy.ops.grating.needs()
    made, _ = read_header(coarse.baked_file())
    # Over so small a range of w one function may suffice. The estimate takes at least two, one tile above the other.
    assert made.columns == 1
    rows = made.strip_rows + max(made.terms, 2) * made.cell_rows
    assert part == pytest.approx(16 * made.width * rows, rel=0.15)
