# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds rendered by a second Blender. Each render takes seconds, so a test checks several things at once."""

import math
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest

from precompute.world_sources.sources import panorama_cells
from tests.addon.worlds.made import painted, world_with
from tests.precompute.world_sources.worlds import COLS, ROWS, direction, disc, picture, sky

CELLS = panorama_cells(ROWS, COLS)
NEAR, FAR = direction(50, 30), direction(35, 150)


def off_deg(one, other):
    return np.degrees(np.arccos(np.clip(one @ other, -1, 1)))


def everything():
    """The contents of the file: the names and user counts of each kind of data."""
    import bpy

    kinds = [own.identifier for own in bpy.data.bl_rna.properties if own.type == "COLLECTION"]
    return {kind: sorted((each.name_full, each.users) for each in getattr(bpy.data, kind)) for kind in kinds}


def skies():
    import bpy

    return [item.identifier for item in bpy.types.ShaderNodeTexSky.bl_rna.properties["sky_type"].enum_items]


@pytest.fixture
def hdri(scene):
    """A world of two soft boxes over a sky, painted in memory; returns the world and its node."""
    world, background = world_with("ShaderNodeTexEnvironment")
    node = background.inputs["Color"].links[0].from_node
    node.interpolation = "Closest"
    node.image = painted(picture(sky() + 20 * disc(NEAR, 5) + 20 * disc(FAR, 7)))
    return world, node


@pytest.mark.night("test_a_second_blender_that_fails_is_told")
def test_a_picture_is_seen_as_blender_lays_it_and_nothing_is_left_behind(addon, scene, hdri):
    """The picture has the panorama's own pixels, so each must come back where it was."""
    world, node = hdri
    before = everything()
    fit = addon.world_probe.fit_of(world, scene, 2)
    assert everything() == before
    given = np.array(node.image.pixels[:]).reshape(ROWS, COLS, 4)[..., :3]
    # A sample on the edge of two pixels may fall into either: rows and columns of 0.01 of a pixel.
    np.testing.assert_allclose(fit.panorama, given, rtol=0.02, atol=0.02)
    wide, small = fit.sources
    assert off_deg(wide.direction, FAR) < 0.15 and off_deg(small.direction, NEAR) < 0.15
    light = (given.reshape(-1, 3) * CELLS.solid_angles[:, None])[CELLS.directions @ FAR > math.cos(wide.cone_radius)]
    np.testing.assert_allclose(wide.irradiance, light.sum(axis=0), rtol=0.02)
    assert fit.missed < 0.001


@pytest.mark.night("test_a_second_blender_that_fails_is_told")
@pytest.mark.parametrize("index", range(4))
def test_the_sun_of_each_sky(addon, scene, index):
    """Irradiance and position against 300 x 300 pixels around the sun, rendered in this Blender."""
    if index >= len(skies()):
        pytest.skip("Blender 4.5 has three skies")
    world, background = world_with("ShaderNodeTexSky")
    node = background.inputs["Color"].links[0].from_node
    node.sky_type = skies()[index]
    if node.sky_type in ("PREETHAM", "HOSEK_WILKIE"):
        # The glow around their sun is at most a source of its own.
        node.sun_direction = direction(30, 70)
        assert all(source.cone_radius > 0.05 for source in addon.world_probe.fit_of(world, scene, 1).sources)
        return
    node.sun_elevation, node.sun_rotation = math.radians(35), math.radians(57)
    sun = direction(35, 90 - 57)
    first = addon.world_probe.fit_of(world, scene, 4).sources[0]
    assert off_deg(first.direction, sun) < 0.02
    # A disc of 0.545 degrees, darker at its limb.
    assert 0.24 < 2 * math.degrees(math.sqrt(first.variance)) < 0.2725
    expected = light_around(scene, world, sun)
    np.testing.assert_allclose(first.irradiance, expected, rtol=0.02)
    node.sun_disc = False
    assert all(source.cone_radius > 0.05 for source in addon.world_probe.fit_of(world, scene, 1).sources)


def light_around(scene, world, sun):
    """The light within 0.34 degrees of a sun, W/m2."""
    import bpy
    from mathutils import Vector

    half, size = math.radians(0.34), 300
    data = bpy.data.cameras.new("at the sun")
    data.type, data.panorama_type = "PANO", "EQUIRECTANGULAR"
    data.latitude_min, data.latitude_max, data.longitude_min, data.longitude_max = -half, half, -half, half
    camera = bpy.data.objects.new("at the sun", data)
    scene.collection.objects.link(camera)
    camera.rotation_euler = Vector(sun).to_track_quat("-Z", "Y").to_euler()
    scene.world, scene.camera, render = world, camera, scene.render
    render.engine, render.resolution_x, render.resolution_y, render.resolution_percentage = "CYCLES", size, size, 100
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 4, False, False
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.filepath = str(Path(bpy.app.tempdir) / "sun.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath)
    image.colorspace_settings.name = "Non-Color"
    values = np.array(image.pixels[:]).reshape(size, size, -1)[..., :3]
    angle = (2 * np.arange(size) + 1 - size) / size * half
    inside = np.hypot(angle[:, None], angle[None, :]) < half
    scene.world = None
    return values[inside].sum(axis=0) * (2 * half / size) ** 2


@pytest.mark.night("tests/precompute/world_sources/test_sources.py")
def test_a_mapping_turns_the_sources(addon, scene, hdri):
    """By 40 degrees about Z, and by an object, through a node group that the file shares."""
    import bpy

    world, node = hdri
    tree = world.node_tree
    mapping, place = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    mapping.vector_type = "POINT"
    mapping.inputs["Rotation"].default_value = (0, 0, math.radians(40))
    tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], node.inputs["Vector"])
    # The picture is read at a direction turned by 40 degrees, so its contents turn back.
    assert off_deg(addon.world_probe.fit_of(world, scene, 1).sources[0].direction, direction(35, 150 - 40)) < 0.2
    turn = bpy.data.objects.new("turn", None)
    scene.collection.objects.link(turn)
    turn.rotation_euler = (0, 0, math.radians(25))
    bpy.context.view_layer.update()
    place.object = turn
    tree.links.new(place.outputs["Object"], mapping.inputs["Vector"])
    before = everything()
    assert off_deg(addon.world_probe.fit_of(world, scene, 1).sources[0].direction, direction(35, 150 - 40 + 25)) < 0.2
    assert everything() == before and place.object == turn


@pytest.mark.night("test_a_second_blender_that_fails_is_told")
def test_what_glossy_rays_see_at_the_present_frame(addon, scene):
    """Through a driven strength, in a group, with a Light Path that shows the camera another colour, and a volume that
    would swallow the world."""
    import bpy

    world, background = world_with("ShaderNodeRGB")
    tree = world.node_tree
    group = bpy.data.node_groups.new("inner", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    out, path, mix = (group.nodes.new(kind) for kind in ("NodeGroupOutput", "ShaderNodeLightPath", "ShaderNodeMix"))
    mix.data_type = "RGBA"
    mix.inputs["A"].default_value, mix.inputs["B"].default_value = (0.2, 0.4, 0.6, 1), (1, 0, 0, 1)
    group.links.new(path.outputs["Is Camera Ray"], mix.inputs["Factor"])
    group.links.new(mix.outputs["Result"], out.inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    tree.links.new(node.outputs[0], background.inputs["Color"])
    volume = tree.nodes.new("ShaderNodeVolumeAbsorption")
    volume.inputs["Density"].default_value = 100
    output = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputWorld")
    tree.links.new(volume.outputs[0], output.inputs["Volume"])
    background.inputs["Strength"].driver_add("default_value").driver.expression = "frame"
    scene.world = world
    scene.frame_set(3)
    try:
        seen = addon.world_probe.fit_of(world, scene, 0).panorama
        np.testing.assert_allclose(seen, np.broadcast_to((0.6, 1.2, 1.8), seen.shape), rtol=1e-5)
        world.cycles_visibility.glossy = False
        assert not addon.world_probe.fit_of(world, scene, 0).panorama.any()
        assert path.outputs["Is Camera Ray"].is_linked and node.node_tree == group
    finally:
        scene.frame_set(1)
        scene.world = None
        bpy.data.worlds.remove(world)


@pytest.mark.night("test_a_second_blender_that_fails_is_told")
def test_a_linked_world(addon, scene, hdri, tmp_path):
    import bpy

    world, node = hdri
    node.image.filepath_raw, node.image.file_format = str(tmp_path / "boxes.exr"), "OPEN_EXR"
    node.image.save()
    file = tmp_path / "library.blend"
    bpy.data.libraries.write(str(file), {world}, fake_user=True)
    bpy.data.worlds.remove(world)
    with bpy.data.libraries.load(str(file), link=True) as (there, here):
        here.worlds = there.worlds
    linked = here.worlds[0]
    assert linked.library is not None
    before = everything()
    first, *_ = addon.world_probe.fit_of(linked, scene, 2).sources
    assert off_deg(first.direction, FAR) < 0.2
    assert everything() == before
    bpy.data.libraries.remove(linked.library)


@pytest.mark.night("test_a_second_blender_that_fails_is_told")
def test_the_colours_are_of_the_files_working_space(addon, scene):
    import bpy

    if bpy.app.version < (5, 0, 0):
        pytest.skip("Blender 4.5 has one working space")
    bpy.ops.wm.set_working_color_space(working_space="ACEScg", convert_colors=False)
    try:
        world, background = world_with("ShaderNodeRGB")
        background.inputs["Color"].links[0].from_node.outputs[0].default_value = (0.1, 0.5, 0.9, 1)
        seen = addon.world_probe.fit_of(world, scene, 0).panorama
        np.testing.assert_allclose(seen, np.broadcast_to((0.1, 0.5, 0.9), seen.shape), rtol=1e-5)
    finally:
        bpy.ops.wm.set_working_color_space(working_space="Linear Rec.709", convert_colors=False)


def test_none_is_rendered_beside_a_render(addon, scene, hdri, monkeypatch):
    monkeypatch.setattr(addon.world_probe, "is_rendering", lambda: True)
    before = everything()
    with pytest.raises(Exception, match="^world tested.*: not fitted while a render is running; try again"):
        addon.world_probe.fit_of(hdri[0], scene, 8)
    assert everything() == before


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """The folder in which private folders are made."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


@pytest.mark.parametrize("code, told", [("exit('no such node')", "no such node"), ("exit(3)", "no message")])
def test_a_second_blender_that_fails_is_told(addon, scene, hdri, monkeypatch, temporary, code, told):
    monkeypatch.setattr(addon.world_probe, "background_blender", lambda *_: [sys.executable, "-c", code])
    before = everything()
    with pytest.raises(Exception, match=rf"^world tested.*: not rendered \({told}\); check its nodes"):
        addon.world_probe.fit_of(hdri[0], scene, 8)
    assert everything() == before and not list(temporary.iterdir())


def test_a_probe_can_be_polled_and_cancelled(addon, scene, hdri, monkeypatch, temporary):
    sleeper = [sys.executable, "-c", "import time; time.sleep(60)"]
    monkeypatch.setattr(addon.world_probe, "background_blender", lambda *_: sleeper)
    probe = addon.world_probe.Probe(hdri[0], scene, 8)
    assert probe.running and list(temporary.iterdir())
    probe.cancel()
    assert not probe.running and not list(temporary.iterdir())


def test_one_that_takes_beyond_reason_is_ended(addon, scene, hdri, monkeypatch, temporary):
    sleeper = [sys.executable, "-c", "import time; time.sleep(60)"]
    monkeypatch.setattr(addon.world_probe, "background_blender", lambda *_: sleeper)
    monkeypatch.setattr(addon.world_probe, "_LONGEST_SECONDS", 0.2)
    with pytest.raises(Exception, match="not rendered within 0.2 s; use smaller pictures"):
        addon.world_probe.fit_of(hdri[0], scene, 8)
    assert not list(temporary.iterdir())


@pytest.mark.night("test_one_that_takes_beyond_reason_is_ended")
def test_a_picture_that_never_ends_is_ended_in_a_window_too(addon, scene, hdri, monkeypatch, temporary):
    """The world's picture is a pipe that nobody writes to. It is polled, as with a window."""
    import bpy

    world, node = hdri
    node.image = bpy.data.images.new("endless", 4, 4)
    node.image.source, node.image.filepath = "FILE", str(temporary / "pipe.exr")
    os.mkfifo(temporary / "pipe.exr")
    monkeypatch.setattr(addon.world_probe, "_LONGEST_SECONDS", 6)
    assert addon.world_changes.fingerprint(world)
    probe = addon.world_probe.Probe(world, scene, 8)
    until = time.monotonic() + 60
    while probe.running:
        assert time.monotonic() < until, "it is never stopped"
        time.sleep(0.1)
    with pytest.raises(Exception, match="not rendered within 6 s; use smaller pictures.* that does not answer$"):
        probe.result()
    assert [path.name for path in temporary.iterdir()] == ["pipe.exr"]


def test_a_file_that_cannot_be_written_is_told(addon, scene, hdri, monkeypatch, temporary):
    """Even if Blender's own writing fails, which raises an OSError without a number."""
    with pytest.raises(OSError, match="Cannot open file"):
        addon.world_probe._write_request(hdri[0], scene, {"folder": str(temporary / "nowhere"), "count": 1})
    monkeypatch.setattr(tempfile, "tempdir", str(temporary / "nowhere"))
    before = everything()
    with pytest.raises(Exception, match=r"nowhere: cannot be written \(No such file or directory\); check its folder"):
        addon.world_probe.fit_of(hdri[0], scene, 1)
    assert everything() == before


@pytest.mark.night("test_a_second_blender_that_fails_is_told")
def test_a_sun_too_small_for_the_samples_of_the_panorama(addon, scene):
    """0.1 degrees wide, darker at its limb: a Sky Texture gives its direction."""
    world, background = world_with("ShaderNodeTexSky")
    node = background.inputs["Color"].links[0].from_node
    node.sun_size, node.sun_elevation, node.sun_rotation = np.radians((0.1, 60, 200))
    first = addon.world_probe.fit_of(world, scene, 4).sources[0]
    assert off_deg(first.direction, direction(60, 90 - 200)) < 0.01
    assert 0.04 < 2 * math.degrees(math.sqrt(first.variance)) < 0.051
