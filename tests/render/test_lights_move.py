# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that move, change, are animated, appear or disappear after Assign, or are linked to objects.

Each picture is compared with that of a scene built with these lamps from the start.
"""

import bpy
import pytest

from .conftest import read_channels, rgb_of
from .lamp_scenes import (
    AFTER,
    BEFORE,
    ENGINES,
    PIXELS,
    add_lamps,
    agree,
    build,
    change,
    differs,
    keep_from,
    now,
    save,
    truth,
)


@pytest.mark.parametrize(("engine", "persistent"), [("cycles", False), ("cycles", True), ("eevee", False)])
def test_a_lamp_changed_after_assignment(stage, baked, engine, persistent):
    wanted = truth(stage, baked[0], AFTER, engine)
    build(stage, baked[0], BEFORE)
    stage.scene.render.use_persistent_data = persistent
    try:
        differs(stage.rgb(engine, PIXELS), wanted)
        change(AFTER)
        agree(stage.rgb(engine, PIXELS), wanted)
    finally:
        stage.scene.render.use_persistent_data = False


def animate(frames):
    """Insert keyframes for all settings of the lamps."""
    for frame, lamps in frames.items():
        change(lamps)
        for name, lamp in lamps.items():
            made = bpy.data.objects[name]
            for path in ("location", "rotation_euler"):
                made.keyframe_insert(path, frame=frame)
            for path in ("color", *lamp.settings):
                made.data.keyframe_insert(path, frame=frame)


@pytest.mark.short("cycles")
@pytest.mark.parametrize(("engine", "persistent"), [("cycles", False), ("cycles", True), ("eevee", False)])
def test_animated_lamps(stage, baked, engine, persistent):
    """By frame_set, and frame by frame in an animation render."""
    wanted = {1: truth(stage, baked[0], BEFORE, engine), 2: truth(stage, baked[0], AFTER, engine)}
    build(stage, baked[0], BEFORE)
    scene = stage.scene
    scene.render.use_persistent_data = persistent
    try:
        animate({1: BEFORE, 2: AFTER})
        for frame in (2, 1):
            scene.frame_set(frame)
            agree(stage.rgb(engine, PIXELS), wanted[frame])
        scene.frame_start, scene.frame_end = 1, 2
        scene.render.filepath = str(stage.folder / "frame_####.exr")
        bpy.ops.render.render(animation=True)
        for frame in (1, 2):
            agree(rgb_of(read_channels(stage.folder / f"frame_{frame:04}.exr")), wanted[frame])
    finally:
        scene.render.use_persistent_data = False


@pytest.mark.parametrize("engine", ENGINES)
def test_after_save_and_reload(files, baked, engine):
    wanted = truth(files, baked[0], AFTER, engine)
    build(files, baked[0], BEFORE)
    path = save(files)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    change(AFTER)
    agree(now(files).rgb(engine, PIXELS), wanted)


@pytest.mark.short("cycles")
@pytest.mark.parametrize(
    ("engine", "listed", "state"),
    [
        ("cycles", "Plane", "EXCLUDE"),
        ("cycles", "Plane", "INCLUDE"),
        ("cycles", "Other", "INCLUDE"),
        ("eevee", "Other", "INCLUDE"),
    ],
)
def test_light_linking(stage, baked, engine, listed, state):
    lit = listed == "Plane" and state == "INCLUDE"
    wanted_without = truth(stage, baked[0], AFTER, engine)
    wanted = truth(stage, baked[0], AFTER if lit else {"Point": AFTER["Point"]}, engine)
    build(stage, baked[0], AFTER)
    stage.add("Other", bpy.data.meshes.new("Other"))
    keep_from(bpy.data.objects["Sun"], bpy.data.objects[listed], state)
    agree(stage.rgb(engine, PIXELS), wanted)
    bpy.data.objects["Sun"].light_linking.receiver_collection = None
    agree(stage.rgb(engine, PIXELS), wanted_without)


@pytest.mark.short("cycles")
@pytest.mark.parametrize("engine", ENGINES)
def test_a_lamp_added_and_deleted(stage, baked, engine):
    wanted, without = truth(stage, baked[0], AFTER, engine), truth(stage, baked[0], {"Sun": AFTER["Sun"]}, engine)
    build(stage, baked[0], {"Sun": AFTER["Sun"]})
    differs(stage.rgb(engine, PIXELS), wanted)
    add_lamps(stage, {"Point": AFTER["Point"]})
    agree(stage.rgb(engine, PIXELS), wanted)
    bpy.data.objects.remove(bpy.data.objects["Point"])
    agree(stage.rgb(engine, PIXELS), without)
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    assert stage.rgb(engine, PIXELS).max() == 0


def test_assigned_before_there_is_a_lamp(stage, baked):
    wanted = truth(stage, baked[0], AFTER, "cycles")
    build(stage, baked[0], {})
    assert stage.rgb("cycles", PIXELS).max() == 0
    add_lamps(stage, AFTER)
    agree(stage.rgb("cycles", PIXELS), wanted)


@pytest.mark.parametrize("kind", ["SUN", "POINT", "SPOT", "AREA"])
def test_only_nodes_that_change_a_lamp_are_reported(stage, kind):
    bpy.ops.object.light_add(type=kind)
    lamp = bpy.context.object
    if bpy.app.version < (5, 0, 0):
        lamp.data.use_nodes = True

    def told():
        return stage.addon.brightest_lamps.unfollowed_features(
            stage.scene, stage.addon.follow.counted_lamps(stage.scene)
        )

    assert told() == []
    emission = next(n for n in lamp.data.node_tree.nodes if n.type == "EMISSION")
    emission.inputs["Strength"].default_value = 2.0
    assert told() == [f"{lamp.name}: its shader nodes are ignored"]
