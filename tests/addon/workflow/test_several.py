# SPDX-License-Identifier: GPL-3.0-or-later
"""Importing several files: as separate gratings, or as scans of one skin whose spectra are averaged."""

import json
import subprocess
import sys
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from PIL import Image

from devtools import ROOT
from tests.addon.layout import Layout, context_of
from tests.hostile import instruments

SIZES = {"size_um": 4.1, "height_nm": 100}


@pytest.fixture
def skins(tmp_path):
    """Three scans of one skin, 4.1 um wide; the last has fewer rows."""
    x = np.arange(64)
    for name, phase, rows in (("one", 0, 64), ("two", 2, 64), ("three", 4, 48)):
        grey = np.tile(32767 + 30000 * np.sin(2 * np.pi * (x + phase) / 8), (rows, 1))
        Image.fromarray(grey.astype(np.uint16)).save(tmp_path / f"{name}.png")
    return tmp_path


def import_files(folder, *names, **more):
    """Import as the file dialog does: all names in `files`, the active one in `filepath`."""
    files = [{"name": name} for name in names]
    return bpy.ops.grating.import_height_map(
        filepath=str(folder / names[0]), directory=f"{folder}/", files=files, **SIZES, **more
    )


def gratings():
    return bpy.context.scene.natural_gratings.items


def test_each_of_several_files_becomes_a_grating(scene, skins):
    assert import_files(skins, "one.png", "two.png") == {"FINISHED"}
    assert [each.name for each in gratings()] == ["one", "two"]
    assert [each.source for each in gratings()] == [str(skins / "one.png"), str(skins / "two.png")]
    assert scene.natural_gratings.active().name == "two"
    assert not any(each.further_scans() for each in gratings())


def test_one_of_several_that_cannot_be_read_adds_none(scene, skins):
    (skins / "bad.png").write_bytes(b"no picture")
    for several in ("EACH", "AVERAGE"):
        with pytest.raises(RuntimeError, match=r"bad\.png: ") as told:
            import_files(skins, "one.png", "bad.png", several=several)
        assert len(str(told.value).strip().splitlines()) == 1
        assert len(gratings()) == 0


def test_several_files_become_one_grating(scene, skins):
    import_files(skins, "one.png", "two.png", "three.png", several="AVERAGE")
    (grating,) = gratings()
    assert grating.name == "one" and grating.levelling == "plane"
    assert grating.summary.endswith("\nthe mean of 3 scans")
    asked = grating.bake_request()
    assert [scan.source for scan in asked.scans] == [str(skins / f"{name}.png") for name in ("one", "two", "three")]
    assert {(scan.size_um, scan.height_nm, scan.channel) for scan in asked.scans} == {(4.1, 100.0, None)}


@pytest.mark.night("tests/addon/operators/test_operators.py")
def test_a_bake_of_several_files_is_that_of_the_command_line(addon, scene, skins, tmp_path, monkeypatch):
    """The cache key and the bytes are equal."""
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(tmp_path / "cache"))
    names = ["one.png", "two.png"]
    report = tmp_path / "facts.json"
    given = ["--size-um", "4.1", "--height-nm", "100", "--delta-e", "6", "--level", "plane,scars"]
    command = [sys.executable, "-m", "precompute", "bake", *(str(skins / name) for name in names), *given]
    command += ["-o", str(tmp_path / "batch"), "--json", str(report)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    import_files(skins, *names, several="AVERAGE")
    (grating,) = gratings()
    grating.delta_e, grating.levelling = 6, "plane,scars"
    facts = addon.baking.bake_and_wait(grating, str(tmp_path / "panel"))
    batch = json.loads(report.read_text())
    assert (batch["cached"], facts["cached"]) == (False, True)
    assert len(facts["files"]) == len(batch["files"])
    for one, other in zip(facts["files"], batch["files"], strict=True):
        with open(one, "rb") as panel, open(other, "rb") as line:
            assert panel.read() == line.read()
    import_files(skins, "one.png")
    gratings()[1].delta_e, gratings()[1].levelling = 6, "plane,scars"
    assert addon.baking.bake_and_wait(gratings()[1], str(tmp_path / "alone"))["cached"] is False


def test_the_quality_of_several_is_the_worst_and_names_the_scan(scene, skins):
    flat = np.full((64, 64), 128, np.uint8)
    flat[0, 0] = 129
    Image.fromarray(flat).save(skins / "flat.png")
    import_files(skins, "one.png", "flat.png", several="AVERAGE")
    (grating,) = gratings()
    light, *findings = grating.quality.splitlines()
    assert light == "poor"
    assert any(line.startswith("flat: period: poor; ") for line in findings)
    assert all(line.startswith(("one: ", "flat: ")) for line in findings)


@pytest.mark.parametrize(("count", "last"), [(2, "1.gsf"), (10, "and 2 more")])
def test_the_panel_shows_which_files_belong_to_a_grating(addon, scene, tmp_path, count, last):
    x = np.arange(64) * 50e-9
    heights = 50e-9 * np.sin(2 * np.pi * x / 800e-9) * np.ones((64, 1))
    names = [f"{number}.gsf" for number in range(count)]
    for name in names:
        (tmp_path / name).write_bytes(instruments.gsf(heights, 50e-9))
    files = [{"name": name} for name in names]
    bpy.ops.grating.import_height_map(
        filepath=str(tmp_path / names[0]), directory=f"{tmp_path}/", files=files, several="AVERAGE"
    )
    layout = Layout()
    context = context_of()
    addon.steps_panel.draw_scans(layout, context, addon.facts.facts_of(context).grating)
    assert layout.labels[0] == "0.gsf" and layout.labels[-1] == last
    assert len(layout.labels) == min(count, 9)


def test_of_one_file_none_is_listed_and_a_broken_request_is_one_line(addon, scene, skins, grating):
    for broken in ("", '{"scans": 3}', '{"scans": [3]}'):
        grating.source, grating.request = str(skins / "one.png"), broken
        layout = Layout()
        context = context_of(2000)
        addon.steps_panel.draw_scans(layout, context, addon.facts.facts_of(context).grating)
        assert len(layout.labels) == (1 if broken else 0)


def test_several_files_that_are_dropped_are_asked_about(addon, skins):
    """A single file is imported at once."""
    asked = []
    manager = SimpleNamespace(invoke_props_dialog=lambda operator: asked.append(operator) or {"RUNNING_MODAL"})
    dropped = SimpleNamespace(
        properties=SimpleNamespace(is_property_set=lambda name: True),
        filepath=str(skins / "one.png"), files=[1, 2], execute=lambda context: {"FINISHED"},
    )  # fmt: skip
    invoke = addon.import_files.ImportHeightMap.invoke
    context = SimpleNamespace(window_manager=manager)
    assert invoke(dropped, context, None) == {"RUNNING_MODAL"} and asked == [dropped]
    dropped.files = [1]
    assert invoke(dropped, context, None) == {"FINISHED"}


def test_several_are_undone_at_once(scene, skins):
    bpy.ops.ed.undo_push(message="before")
    import_files(skins, "one.png", "two.png")
    bpy.ops.ed.undo_push(message="imported")
    bpy.ops.ed.undo()
    assert len(gratings()) == 0
