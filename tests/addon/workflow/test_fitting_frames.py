# SPDX-License-Identifier: GPL-3.0-or-later
"""The sources of an animated world by frame: keyed, dropped, undone, and cancelled. They are found without a render."""

import numpy as np
import pytest

from precompute.world_sources.sources import Source
from tests.addon.worlds.made import world_with

FIRST, LAST = 3, 6


def sun(frame):
    """Another sun in each frame."""
    return Source(np.array((0.0, 0.6, 0.8)), np.array((float(frame), 2.0, 1.0)), 1e-4)


@pytest.fixture
def sky(addon, scene, grating, monkeypatch):
    """The Background of a sky whose strength is keyed. Frame 5 has two suns."""
    import bpy

    class Probe:
        running, status, ended = False, 0, []

        def __init__(self, world, scene, count):
            self._frame = scene.frame_current

        def wait(self):
            pass

        def cancel(self):
            self.ended.append(self._frame)

        def result(self):
            suns = [sun(self._frame)] * (2 if self._frame == 5 else 1)
            return addon.world_probe.Fit(None, suns, 0.01 * self._frame)

    monkeypatch.setattr(addon.fitting_frames, "Probe", Probe)
    scene.world, background = world_with("ShaderNodeTexSky")
    for frame, strength in ((1, 0.0), (9, 1.0)):
        background.inputs["Strength"].default_value = strength
        background.inputs["Strength"].keyframe_insert("default_value", frame=frame)
    scene.frame_start, scene.frame_end, scene.frame_step = FIRST, LAST, 1
    scene.frame_set(4)
    assert bpy.ops.grating.assign() == {"FINISHED"}
    yield background
    scene.world = None
    addon.sky.forget_sources(scene)
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 250, 1
    scene.frame_set(1)


def powers(scene, frame):
    """The red light of both sources in a frame."""
    scene.frame_set(frame)
    return [scene[f"ng_world_{index}_power"][0] for index in (0, 1)]


def test_each_frame_has_its_own_sources(addon, scene, sky):
    import bpy

    assert addon.fitting_worlds.unfitted_world(scene)
    assert bpy.ops.grating.fit_frames() == {"FINISHED"}
    assert scene.frame_current == 4
    assert addon.sky.source_count(scene) == 2
    assert addon.sky.missed_share(scene) == pytest.approx(0.06)
    found = {frame: powers(scene, frame) for frame in range(FIRST - 2, LAST + 3)}
    dark = {frame: [0, 0] for frame in (1, 2, 7, 8)}
    assert found == dark | {3: [3, 0], 4: [4, 0], 5: [5, 5], 6: [6, 0]}
    # No frame shows a mixture.
    scene.frame_set(4, subframe=0.5)
    assert scene["ng_world_0_power"][0] == 4
    scene.frame_set(4)
    assert addon.fitting_worlds.unfitted_world(scene) == []
    scene.frame_set(8)
    (line,) = addon.fitting_worlds.unfitted_world(scene)
    assert "3 to 6" in line


def test_every_other_frame(addon, scene, sky):
    """The frames between have no sources: their light stays with the closures."""
    import bpy

    scene.frame_step = 2
    assert bpy.ops.grating.fit_frames() == {"FINISHED"}
    assert [powers(scene, frame)[0] for frame in (3, 4, 5, 6)] == [3, 0, 5, 0]


def test_the_materials_read_the_keys(addon, scene, sky):
    """Drivers copy each frame's values into the nodes, without the extension."""
    import bpy

    assert bpy.ops.grating.fit_frames() == {"FINISHED"}
    group = next(filter(addon.skin.is_diffraction, bpy.data.node_groups))
    bpy.context.object.data.materials[0] = scene.natural_gratings.active().material
    for frame in (3, 6, 8):
        scene.frame_set(frame)
        evaluated = group.evaluated_get(bpy.context.evaluated_depsgraph_get())
        node = next(node for node in evaluated.nodes if node.label == "ng_world_0_power" and len(node.inputs))
        assert node.inputs[0].default_value == (frame if frame <= LAST else 0)


@pytest.mark.parametrize("how", ["the strength's keys", "not animated", "another world"])
def test_a_changed_world_drops_all_frames(addon, scene, sky, how):
    import bpy

    assert bpy.ops.grating.fit_frames() == {"FINISHED"}
    for frame in range(1, 9):
        scene.frame_set(frame)
        assert addon.fitting_worlds.drop_stale_sources(scene) == "" and addon.sky.source_count(scene) == 2
    scene.frame_set(4)
    if how == "another world":
        scene.world, _ = world_with("ShaderNodeTexGradient")
    elif how == "not animated":
        scene.world.node_tree.animation_data_clear()
    else:
        sky.inputs["Strength"].default_value = 3.0
        sky.inputs["Strength"].keyframe_insert("default_value", frame=4)
        scene.frame_set(4)
    addon.fitting_worlds.drop_stale_sources(scene)
    assert addon.sky.source_count(scene) == 0
    assert addon.sky.fitted_frames(scene) == {}
    assert scene.animation_data is None or scene.animation_data.action is None


def test_the_artists_own_keys_stay(addon, scene, sky):
    import bpy

    scene.gravity.z = -5
    scene.keyframe_insert("gravity", index=2, frame=2)
    try:
        assert bpy.ops.grating.fit_frames() == {"FINISHED"}
        assert bpy.ops.grating.fit_world() == {"FINISHED"}
        assert addon.sky.source_count(scene) == 0
        bags = [bag for layer in scene.animation_data.action.layers for bag in layer.strips[0].channelbags]
        assert [curve.data_path for bag in bags for curve in bag.fcurves] == ["gravity"]
    finally:
        scene.animation_data.action = None
        scene.gravity.z = -9.81


def test_a_cancelled_job_changes_nothing(addon, scene, sky):
    job = addon.fitting_frames.FrameFits(scene, [3, 4, 5])
    assert job.running and job.running
    assert job.progress() == ("frame 5", pytest.approx(2 / 3))
    addon.light.FitFrames.job = job
    addon.light.FitFrames.stop()
    assert addon.light.FitFrames.job is None
    assert not job.running and scene.frame_current == 4
    assert addon.sky.source_count(scene) == 0 and "ng_world_frames" not in scene


def test_what_cannot_be_fitted_is_refused(addon, scene, sky, grating):
    import bpy

    with pytest.raises(RuntimeError, match="0 frames: a fit takes from 1"):
        bpy.ops.grating.fit_frames(first=9, last=8)
    scene.world, _ = world_with("ShaderNodeTexGradient")
    with pytest.raises(RuntimeError, match="it is not animated; press Fit World instead"):
        bpy.ops.grating.fit_frames()
    assert scene.frame_current == 4


@pytest.mark.night("test_each_frame_has_its_own_sources")
@pytest.mark.parametrize("text", ["", "x", "1:", "4:00ff", "a:b c", "4", "9" * 5000])
def test_a_forged_record_does_no_harm(addon, scene, sky, text):
    """A record without frames, or with another fingerprint for this one: its sources are dropped."""
    import bpy

    assert bpy.ops.grating.fit_frames() == {"FINISHED"}
    scene["ng_world_frames"] = text
    addon.fitting_worlds.drop_stale_sources(scene)
    assert addon.sky.source_count(scene) == (2 if text in ("1:", "4") else 0)
    assert addon.fitting_worlds.unfitted_world(scene) or text == "4"


def test_the_panel_offers_to_fit_them_again(addon, scene, sky, grating):
    import bpy

    from tests.addon.layout import Layout, context_of

    assert bpy.ops.grating.fit_frames() == {"FINISHED"}
    layout, context = Layout(), context_of()
    addon.light_part.draw_light(layout, context, grating, facts=addon.facts.facts_of(context))
    assert layout.operators.count("grating.fit_frames") == 1


def test_its_keys_go_with_the_last_grating(addon, scene, sky):
    """A grating in the list shows the world again once it is assigned, and so does a material."""
    import bpy

    assert bpy.ops.grating.fit_frames() == {"FINISHED"}
    bpy.ops.grating.remove_diffraction()
    assert addon.sky.notes_frames(scene)
    bpy.data.batch_remove(list(bpy.data.materials))
    assert addon.sky.notes_frames(scene)
    while scene.natural_gratings.items:
        bpy.ops.grating.remove()
    assert not [key for key, _ in scene.items() if key.startswith("ng_world")]
    assert not (scene.animation_data and scene.animation_data.action)
