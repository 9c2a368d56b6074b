# SPDX-License-Identifier: GPL-3.0-or-later
"""The levelling steps as a list in the panel, and the preview of the levelled scan."""

import importlib

import bpy
import numpy as np
import pytest
from PIL import Image

from devtools import EXTENSION
from precompute.surface.steps.pipeline import KINDS
from precompute.surface.steps.step import Number
from tests.addon.layout import Layout, context_of


def active():
    """The active grating, looked up again because undo frees Python's references."""
    return bpy.context.scene.natural_gratings.active()


@pytest.fixture
def steps(addon, scene, scan):
    """A function that optionally sets the imported grating's steps and returns them as text."""
    addon.levelling.stop()
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)

    def taken(text=None):
        if text is not None:
            active().levelling = text
        return active().levelling

    yield taken
    addon.levelling.stop()


def test_a_scan_begins_with_a_plane(steps):
    assert steps() == "plane"


def test_steps_are_added_after_the_active_one_moved_and_removed(steps):
    bpy.ops.grating.add_step(kind="dust")
    bpy.ops.grating.add_step(kind="invert")
    assert (steps(), active().active_step) == ("plane,dust:5,invert", 2)
    bpy.ops.grating.move_step(direction="UP")
    assert (steps(), active().active_step) == ("plane,invert,dust:5", 1)
    bpy.ops.grating.add_step(kind="scars")
    assert steps() == "plane,invert,scars:1,dust:5"
    bpy.ops.grating.move_step(direction="DOWN")
    assert (steps(), active().active_step) == ("plane,invert,dust:5,scars:1", 3)
    assert bpy.ops.grating.move_step(direction="DOWN") == {"CANCELLED"}
    bpy.ops.grating.remove_step()
    assert (steps(), active().active_step) == ("plane,invert,dust:5", 2)
    for _ in range(3):
        bpy.ops.grating.remove_step()
    assert (steps(), active().active_step) == ("none", 0)
    assert not bpy.ops.grating.remove_step.poll() and not bpy.ops.grating.move_step.poll()
    bpy.ops.grating.add_step(kind="plane")
    assert steps() == "plane"


def test_every_kind_is_in_the_menu_with_its_form_and_can_be_added(steps):
    menu = bpy.ops.grating.add_step.get_rna_type().properties["kind"]
    assert menu.name == "Step"
    for name in KINDS:
        assert bpy.ops.grating.add_step(kind=name) == {"FINISHED"}
    assert [step.text.partition(":")[0] for step in active().steps] == ["plane", *KINDS]
    assert "crop:0:0:4:4" in steps()


def test_the_menu_tells_what_each_does_with_units(addon):
    entries = {name: (label, told) for name, label, told in addon.level_steps._kinds()}
    assert list(entries) == list(KINDS)
    label, told = entries["crop"]
    assert label == "Crop" and told.endswith("in um from the left and upper edge: crop:LEFT:TOP:RIGHT:BOTTOM")


def test_calibration_needs_a_grating(steps, tmp_path):
    Image.fromarray(np.zeros((64, 64), np.uint8)).save(tmp_path / "flat.png")
    bpy.ops.grating.import_height_map(filepath=str(tmp_path / "flat.png"), size_um=4, height_nm=100)
    with pytest.raises(RuntimeError, match="calibrate: no grating stands out"):
        bpy.ops.grating.add_step(kind="calibrate")
    assert steps() == "plane"


@pytest.mark.parametrize(("text", "name", "value", "then"), [
    ("dust", "threshold", 4.2, "dust:4.2"), ("dust", "threshold", 1e9, "dust:1000"),
    ("rotate:3", "angle_deg", 0, "rotate:0"),
    ("poly", "degree", 3, "poly:3"), ("crop:0:0:4:4", "right_um", 3.3, "crop:0:0:3.3:4"),
    ("plane", "fit", "robust", "plane:robust"), ("plane:robust", "fit", "least-squares", "plane"),
    ("lines", "by", "difference", "lines:difference"), ("tip:10", "length_nm", 7.25, "tip:7.25"),
    ("zscale:1", "factor", 0.1, "zscale:0.1"), ("scars", "threshold", 0.1, "scars:0.1"),
])  # fmt: skip
def test_arguments_are_written_into_the_text(steps, text, name, value, then):
    steps(text)
    assert active().steps[0].shown()[0] == name or name == "right_um"
    setattr(active().steps[0], name, value)
    assert steps() == then
    shown = getattr(active().steps[0], name)
    assert shown == (value if isinstance(value, str) else pytest.approx(min(value, 1000)))


def test_every_argument_has_a_property_that_takes_what_the_step_takes(addon):
    """The panel thus accepts everything that the command line accepts."""
    step = addon.levelling_steps.LevellingStep.bl_rna.properties
    for kind in KINDS.values():
        for argument in kind.arguments:
            shown = step[addon.levelling_steps.ARGUMENTS[argument.name]]
            assert shown.name and shown.description
            if isinstance(argument, Number):
                assert shown.hard_min <= argument.low + 1e-6 and shown.hard_max >= argument.high
                assert (shown.type == "INT") is argument.whole
            else:
                assert tuple(shown.enum_items.keys()) == argument.words


def test_each_edit_is_undone_by_itself(steps):
    edits = (
        lambda: bpy.ops.grating.add_step(kind="dust"),
        lambda: bpy.ops.grating.move_step(direction="UP"),
        lambda: setattr(active().steps[0], "threshold", 7),
        lambda: bpy.ops.grating.remove_step(),
        lambda: bpy.ops.grating.steps_as_text(steps="plane:robust,scars,dust:4"),
    )
    bpy.ops.ed.undo_push(message="before")
    texts = [steps()]
    for edit in edits:
        edit()
        bpy.ops.ed.undo_push(message="edit")
        texts.append(steps())
    assert texts == ["plane", "plane,dust:5", "dust:5,plane", "dust:7,plane", "plane", "plane:robust,scars:1,dust:4"]
    for text in reversed(texts[:-1]):
        bpy.ops.ed.undo()
        assert steps() == text
    for text in texts[1:]:
        bpy.ops.ed.redo()
        assert steps() == text


def test_the_dialog_of_the_text_begins_with_the_steps(addon, steps):
    """The panel's steps and the command line's are one text."""
    steps("plane,dust:4")
    assert bpy.ops.grating.steps_as_text(steps="plane:robust") == {"FINISHED"}
    assert steps() == "plane:robust"
    assert bpy.ops.grating.steps_as_text.get_rna_type().properties["steps"].is_skip_save


def drawn(addon, *, folded=False):
    """What the panel draws for the active grating's surface, by default with its levelling open."""
    layout, context = Layout(folded), context_of(2000)
    addon.surface_part.draw_surface(layout, context, active(), facts=addon.facts.facts_of(context).grating)
    return layout


def test_the_panel_draws_the_preview_above_the_folded_steps(addon, steps):
    """The preview shows what the step Levelling does to a scan that waits for its bake. It repeats no fact."""
    steps("plane,dust")
    active().active_step = 1
    layout = drawn(addon)
    assert "Levelling: plane,dust:5" in layout.labels
    assert layout.lists == ["GRATING_UL_steps"] and layout.props == ["threshold"]
    own = {"grating.add_step", "grating.remove_step", "grating.move_step", "grating.steps_as_text"}
    assert own <= set(layout.operators)
    layout = drawn(addon, folded=True)
    assert layout.labels[:2] == ["4 x 4 um", "Levelling the scan ..."] and layout.pictures == 0
    assert not layout.lists and not own & set(layout.operators)
    addon.levelling.refresh()
    layout = drawn(addon, folded=True)
    assert layout.pictures == 2
    assert not [label for label in layout.labels if label.startswith(("relief", "period"))]
    # With 8 pixels per period of 100 nm the highest pixels are half a pixel off the top: 100 nm cos(pi / 8).
    assert {"As scanned", "Levelled", "range 92.39 nm"} <= set(layout.labels)
    assert "500 nm at 0 deg" in layout.labels


def test_a_preview_is_made_once_for_each_choice_of_steps(addon, steps, monkeypatch):
    """Redrawing the panel makes no new preview, and after undo an earlier preview is reused."""
    made = []
    module = importlib.import_module(f"{EXTENSION}.precompute.surface.preview")
    preview = module.preview
    monkeypatch.setattr(module, "preview", lambda *given: made.append(given) or preview(*given))
    for text, count in (("plane", 1), ("plane,invert", 2), ("plane", 2)):
        steps(text)
        for _ in range(3):
            addon.levelling.shown(active())
        assert bpy.app.timers.is_registered(addon.levelling.refresh) is (count > len(made))
        if count > len(made):
            bpy.app.timers.unregister(addon.levelling.refresh)
            addon.levelling.refresh()
        assert len(made) == count
        assert addon.levelling.shown(active()).preview is not None


def test_the_scan_is_read_once_for_all_steps(addon, steps):
    held = addon.levelling.scan_of(active())
    steps("plane,invert")
    assert addon.levelling.scan_of(active()) is held


def test_the_pictures_are_the_scans(addon, steps):
    """Blender's rows run upwards."""
    addon.levelling.shown(active())
    addon.levelling.refresh()
    found = addon.levelling.shown(active()).preview
    (pictures,) = addon.levelling._pictures
    assert len(pictures) == 2
    for image, look in zip(pictures.values(), (found.before, found.after), strict=True):
        assert tuple(image.image_size) == (64, 64)
        held = np.array(image.image_pixels_float[:]).reshape(64, 64, 4)
        assert np.abs(held[::-1, :, :3] - look.picture).max() <= 0.5 / 255 + 1e-6  # 8-bit rounding
        assert (held[..., 3] == 1).all()


def test_line_alignment_is_warned_of_before_the_bake(addon, scene, tmp_path):
    lines = np.tile(127 + 100 * np.sin(2 * np.pi * np.arange(64) / 8), (64, 1)).T
    Image.fromarray(lines.astype(np.uint8)).save(tmp_path / "rows.png")
    bpy.ops.grating.import_height_map(filepath=str(tmp_path / "rows.png"), size_um=4, height_nm=100)
    active().levelling = "plane,lines"
    addon.levelling.shown(active())
    addon.levelling.refresh()
    layout = drawn(addon)
    assert "lines: weakens the main peak of the grating (500 nm at 90 deg) by 100%" in layout.noted("ERROR")


@pytest.mark.parametrize(("text", "fault"), [
    ("crop:90:90:99:99", "crop: no pixel is between 90 and 99 um"), ("calibrate:9000", "far from 9000 nm"),
])  # fmt: skip
def test_a_step_that_fails_is_one_line_in_the_panel(addon, steps, text, fault):
    steps(text)
    addon.levelling.shown(active())
    addon.levelling.refresh()
    layout = drawn(addon)
    assert fault in layout.noted("ERROR") and layout.pictures == 0


def test_a_scan_that_is_gone_is_one_line_in_the_panel(addon, scene, scan, tmp_path):
    addon.levelling.stop()
    gone = tmp_path / "gone.png"
    gone.write_bytes(scan.read_bytes())
    bpy.ops.grating.import_height_map(filepath=str(gone), size_um=4, height_nm=100)
    gone.unlink()
    addon.levelling.shown(active())
    addon.levelling.refresh()
    assert "gone.png: cannot be read" in drawn(addon).noted("ERROR")


def test_a_text_that_is_no_step_is_one_line_in_the_panel(addon, steps):
    active().steps[0].text = "grate"
    assert "Levelling: no such step" in drawn(addon).noted("ERROR")


def test_once_a_scan_is_baked_only_the_steps_text_is_shown(addon, steps):
    """Until the artist opens the list: it is long, and the next controls stand below it."""
    active().bake_path = "waves.exr"
    layout = drawn(addon, folded=True)
    assert layout.labels[-1] == "Levelling: plane" and not layout.lists and layout.pictures == 0
    assert [label for label in layout.labels if label.startswith("period")]
    assert "Levelling the scan ..." in drawn(addon).labels


def test_of_a_grating_made_from_a_bake_nothing_is_levelled(addon, grating):
    layout = drawn(addon)
    assert layout.labels == ["Made from a bake, without a scan"] and not layout.lists
    assert "grating.add_step" not in layout.operators


def test_what_was_kept_is_given_back(addon, steps, monkeypatch):
    monkeypatch.setattr(addon.levelling, "_KEPT_MAX", 2)
    for text in ("plane", "invert", "plane,invert"):
        steps(text)
        addon.levelling.shown(active())
        addon.levelling.refresh()
    assert len(addon.levelling._shown) == 1 and len(addon.levelling._pictures[0]) == 2
    addon.levelling.shown(active())
    addon.levelling.stop()
    assert not addon.levelling._shown and not addon.levelling._pictures
    assert not bpy.app.timers.is_registered(addon.levelling.refresh)


def test_a_large_scan_is_previewed_thinned_and_it_is_said(addon, scene, tmp_path):
    grey = np.tile(127 + 100 * np.sin(2 * np.pi * np.arange(1100) / 16), (1100, 1))
    Image.fromarray(grey.astype(np.uint8)).save(tmp_path / "large.png")
    bpy.ops.grating.import_height_map(filepath=str(tmp_path / "large.png"), size_um=55, height_nm=100)
    addon.levelling.shown(active())
    addon.levelling.refresh()
    assert "The preview shows 1 pixel in 2 along x and y. The bake uses all pixels" in drawn(addon).noted("NONE")
