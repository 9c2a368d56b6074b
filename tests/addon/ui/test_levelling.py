# SPDX-License-Identifier: GPL-3.0-or-later
"""Levelling and the quality of a scan in the panel."""

import json

import bpy
import numpy as np
import pytest
from PIL import Image

from precompute.table.atlas import read_header
from tests.addon.layout import Layout, context_of


@pytest.fixture
def imported(scene, scan):
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    return scene.natural_gratings.active()


@pytest.mark.night("test_without_a_word_a_plane_is_taken_out_and_none_takes_nothing")
def test_the_panels_steps_are_those_of_the_bake(imported, tmp_path):
    imported.levelling = "plane,dust,rotate:90"
    assert bpy.ops.grating.bake(directory=str(tmp_path)) == {"FINISHED"}
    _, record = read_header(imported.baked_file())
    assert record["request"]["levelling"] == ["plane", "dust:5", "rotate:90"]


def test_without_a_word_a_plane_is_taken_out_and_none_takes_nothing(imported):
    assert [step.text for step in imported.bake_request().levelling] == ["plane"]
    imported.levelling = "none"
    assert imported.bake_request().levelling == ()


@pytest.mark.parametrize("steps", ["plane,grate", "", "rotate", "plane;dust"])
def test_steps_that_are_none_are_told_in_one_line_and_change_nothing(imported, steps):
    with pytest.raises(RuntimeError, match=f"{imported.name}: Levelling: .*; ?give") as told:
        bpy.ops.grating.steps_as_text(steps=steps)
    assert len(str(told.value).strip().splitlines()) == 1
    assert imported.levelling == "plane"


def test_steps_that_a_file_holds_and_are_none_fail_the_bake_in_one_line(imported, tmp_path):
    imported.steps[0].text = "grate"
    with pytest.raises(RuntimeError, match=f"{imported.name}: Levelling: no such step; give one of") as told:
        bpy.ops.grating.bake(directory=str(tmp_path))
    assert len(str(told.value).strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.night("tests/addon/workflow/test_measuring_needs.py")
def test_a_request_fills_the_list_and_is_repeated(addon, scene, scan, tmp_path):
    facts = tmp_path / "facts.json"
    line = ["bake", str(scan), "--size-um", "4", "--height-nm", "100", "-o", str(tmp_path), "--delta-e", "6"]
    levelled = ["--level", "plane:robust,rotate:180", "--json", str(facts)]
    assert addon.commands.execute([*line, *levelled, "--save", str(tmp_path / "a.blend")]) == 0
    grating = bpy.context.scene.natural_gratings.active()
    assert grating.levelling == "plane:robust,rotate:180"
    assert grating.baked_file().samefile(json.loads(facts.read_text())["files"][0])
    assert addon.commands.execute([*line, "--level", "none", "--save", str(tmp_path / "a.blend")]) == 0
    assert bpy.context.scene.natural_gratings.active().levelling == "none"


@pytest.mark.night("test_without_a_word_a_plane_is_taken_out_and_none_takes_nothing")
def test_line_alignment_is_warned_of(scene, tmp_path, capfd):
    """With grooves along the scan's x axis; after the bake a warning names what the step removes."""
    lines = np.tile(127 + 100 * np.sin(2 * np.pi * np.arange(64) / 8), (64, 1)).T
    Image.fromarray(lines.astype(np.uint8)).save(tmp_path / "rows.png")
    bpy.ops.grating.import_height_map(filepath=str(tmp_path / "rows.png"), size_um=4, height_nm=100)
    grating = scene.natural_gratings.active()
    grating.delta_e, grating.levelling = 6, "plane,lines"
    capfd.readouterr()
    assert bpy.ops.grating.bake(directory=str(tmp_path)) == {"FINISHED"}
    (told,) = [line for line in capfd.readouterr().out.splitlines() if line.startswith("Warning: ")]
    assert "lines: weakens the main peak of the grating (500 nm at 90 deg) by 100%" in told


def drawn(addon, grating):
    """The labels and icons that the panel draws for a grating's quality."""
    layout = Layout(folded=False)
    addon.surface_part.draw_rating(layout, context_of(2000), grating)
    return list(zip(layout.labels, layout.icons, strict=True))


def test_the_panel_shows_what_limits_a_scan(addon, scene, tmp_path):
    """Dust on a good grating, 8 bits over 80 nm; the remedy uses the panel's own words."""
    x = np.arange(256)
    grey = np.tile(127 + 60 * np.sin(2 * np.pi * x / 16), (256, 1)) + np.random.default_rng(0).normal(0, 2, (256, 256))
    grey[100:110, 60:70] = 255
    Image.fromarray(np.clip(grey, 0, 255).astype(np.uint8)).save(tmp_path / "dusty.png")
    bpy.ops.grating.import_height_map(filepath=str(tmp_path / "dusty.png"), size_um=16, height_nm=80)
    (light, icon), *findings = drawn(addon, scene.natural_gratings.active())
    assert (light, icon) == ("Scan: good", "CHECKMARK") and findings == []
    grey[100:110, 60:70] = 25500
    Image.fromarray((np.clip(grey, 0, 600) * 100).astype(np.uint16)).save(tmp_path / "worse.png")
    bpy.ops.grating.import_height_map(filepath=str(tmp_path / "worse.png"), size_um=16, height_nm=80 * 65535 / 25500)
    (light, icon), *findings = drawn(addon, scene.natural_gratings.active())
    assert (light, icon) == ("Scan: usable", "INFO")
    ((text, _),) = findings
    assert text.startswith("dirt: ") and text.endswith("bake it with Levelling plane,dust")
    for offered in (["grating.add_step"], []):  # until the step is there
        layout = Layout()
        addon.surface_part.draw_rating(layout, context_of(), scene.natural_gratings.active())
        assert (layout.labels, layout.operators) == (["Scan: usable"], offered)
        bpy.ops.grating.add_step(kind="dust")


def test_of_a_grating_without_a_scan_no_quality_is_drawn(addon, scene):
    assert drawn(addon, scene.natural_gratings.items.add()) == []
