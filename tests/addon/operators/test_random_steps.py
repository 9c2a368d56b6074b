# SPDX-License-Identifier: GPL-3.0-or-later
"""A short random session: buttons, an artist's acts, undo and redo. `./dev bench random_steps` runs long ones."""

import bpy
import pytest

from laboratory.benchmarks.hostile import steps_checks, steps_session
from laboratory.benchmarks.hostile.lying_scene import write_scan
from laboratory.benchmarks.hostile.steps_buttons import BUTTONS

SEED, STEPS = 3, 40


@pytest.fixture
def afterwards(addon):
    """Restores an empty file and the preferences."""
    kept = bpy.context.preferences.edit.undo_steps
    yield addon
    bpy.context.preferences.edit.undo_steps = kept
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def test_every_operator_is_drawn(addon):
    operators = [cls.bl_idname for cls in addon.package.CLASSES if issubclass(cls, bpy.types.Operator)]
    assert sorted(f"grating.{name}" for name in BUTTONS) == sorted(operators)


@pytest.mark.night("tests/addon/operators/test_every_button.py")
def test_a_short_session(afterwards, tmp_path):
    scan = write_scan(tmp_path / "waves.png")
    records = list(steps_session.run(afterwards, scan, seed=SEED, steps=STEPS))
    ended = [record for record in records if "fault" in record]
    assert [f"{each['step']}: {each['does']}: {each['fault']}" for each in ended if each["fault"]] == []
    assert len(ended) == STEPS + 3


def raises():
    raise KeyError("x")


def prints():
    print("Traceback (most recent call last):\n  KeyError: 'x'")
    return ""


def outside():
    bpy.context.scene.natural_gratings.active_index = 7
    return ""


@pytest.mark.parametrize("act", [raises, prints, outside])
def test_a_fault_is_found(addon, scene, act):
    assert steps_session.judged(addon, act)["fault"]


def test_what_is_left_is_found(scene, addon):
    """An image that nothing uses but its fake user is the artist's; the others are faults."""
    bpy.data.images.new("Map", 1, 1).use_fake_user = True
    bpy.data.materials.new("Kept").use_fake_user = True
    assert [each.split(",")[0] for each in steps_checks.leftovers()] == ["materials: Kept"]


def test_what_undo_should_restore_is_compared():
    before = {"images": ("a", "b"), "meshes": ("m",)}
    assert steps_checks.differences(before, dict(before)) == ""
    assert steps_checks.differences(before, {"images": ("b", "c"), "meshes": ("m",)}) == "images: - ['a'] + ['c']"
