# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake whose file is missing: it comes back from the cache, from the pictures in the .blend, or by a new bake."""

import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

from tests.addon.conftest import select
from tests.addon.layout import Layout, context_of

LINE = "The file of its bake is gone"


@pytest.fixture
def imported(scene, scan, addon):
    """A grating, imported and baked into the cache. The plane is selected."""
    addon.levelling.stop()
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    scene.natural_gratings.active().delta_e = 6.0
    assert bpy.ops.grating.bake() == {"FINISHED"}
    yield scene.natural_gratings.active()
    addon.levelling.stop()
    if bpy.data.filepath:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def active():
    return bpy.context.scene.natural_gratings.active()


def drawn(addon):
    layout = Layout()
    addon.panel.GratingPanel.draw(SimpleNamespace(layout=layout), context_of())
    return layout


def following(addon):
    return addon.facts.next_step(context_of(), active(), addon.facts.facts_of(context_of()))


def reopened(path):
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    select(bpy.data.objects["Plane"])


@pytest.mark.night("test_a_bake_of_another_version_is_told")
def test_a_deleted_folder_is_the_next_step_and_bake_brings_it_back(imported, addon):
    assert following(addon).operator == "grating.assign"
    shutil.rmtree(imported.baked_file().parent)
    step = following(addon)
    assert (step.sentence, step.operator, step.text) == (LINE, "grating.bake", "Bake Again")
    assert LINE in drawn(addon).labels
    with pytest.raises(
        RuntimeError, match=r"waves: its bake waves.exr is gone from the cache; press Bake Grating again"
    ):
        bpy.ops.grating.assign()
    assert bpy.ops.grating.bake() == {"FINISHED"} and bpy.ops.grating.assign() == {"FINISHED"}
    assert imported.baked_file().is_file()


@pytest.mark.night("test_a_bake_of_another_version_is_told")
def test_a_bake_that_the_blend_holds_is_not_missed(imported, addon):
    """The material shows its packed pictures, and the chart brings the files back from them."""
    assert bpy.ops.grating.assign() == {"FINISHED"}
    shutil.rmtree(imported.baked_file().parent)
    assert LINE not in drawn(addon).labels
    assert bpy.ops.grating.show_picture(kind="CHART") == {"FINISHED"}
    assert imported.baked_file().is_file()


@pytest.mark.parametrize("is_assigned", [True, False])
def test_a_blend_that_was_moved_finds_its_bake_or_makes_it_anew(imported, addon, tmp_path, is_assigned):
    """The scan and the bake lie beside the .blend; only the .blend and the scan are moved, and the cache is empty."""
    home, away = tmp_path / "home", tmp_path / "away"
    home.mkdir()
    away.mkdir()
    shutil.copy(imported.source, home)
    shutil.copytree(imported.baked_file().parent, home / "bakes")
    if is_assigned:
        assert bpy.ops.grating.assign() == {"FINISHED"}
    shutil.rmtree(imported.baked_file().parent)
    imported.source, imported.bake_path = "//waves.png", "//bakes/waves.exr"
    reopened(home / "shot.blend")
    assert active().baked_file() == home / "bakes" / "waves.exr" and LINE not in drawn(addon).labels
    for name in ("shot.blend", "waves.png"):
        (home / name).rename(away / name)
    bpy.ops.wm.open_mainfile(filepath=str(away / "shot.blend"))
    select(bpy.data.objects["Plane"])
    assert (LINE in drawn(addon).labels) != is_assigned
    if not is_assigned:
        assert bpy.ops.grating.bake() == {"FINISHED"}
    assert bpy.ops.grating.assign() == {"FINISHED"} and addon.finding_bakes.bake_of(active()).is_file()


@pytest.mark.night("tests/addon/assets/test_assets.py")
def test_a_preset_without_its_draft_is_baked(scene, addon, monkeypatch):
    """The folder of drafts is not in the repository, and an artist may delete it or clear the cache."""
    monkeypatch.setattr(addon.baking, "shipped_draft", lambda *_: None)
    assert bpy.ops.grating.add_preset(preset="gold_foil", assign=False) == {"FINISHED"}
    assert active().bake_path == "" and following(addon).operator == "grating.bake"
    assert bpy.ops.grating.bake() == {"FINISHED"}
    assert addon.grating.quality_of(active()) == "DRAFT"
    shutil.rmtree(Path(active().bake_path).parent)
    assert following(addon).sentence == LINE
    assert bpy.ops.grating.bake() == {"FINISHED"} and bpy.ops.grating.assign() == {"FINISHED"}


def test_a_grating_of_a_bake_alone_asks_for_the_file(scene, grating, addon, tmp_path):
    grating.bake_path = str(tmp_path / "gone.exr")
    step = following(addon)
    assert step.sentence == f"{LINE}. Load it again, or import the height map" and step.operator == ""


def test_a_bake_of_another_version_is_told(imported, addon):
    settings = json.loads(imported.asked)
    del settings["delta_e"]
    imported.asked = json.dumps(settings)
    assert "Baked by another version of the extension" in " ".join(drawn(addon).labels)


@pytest.mark.night("test_a_blend_that_was_moved_finds_its_bake_or_makes_it_anew")
def test_undo_takes_a_new_bake_of_an_opened_file_back(imported, addon, tmp_path):
    """In Blender 4.5 about half of such undos crashed, until replaced node groups were no longer deleted."""
    bpy.ops.grating.assign()
    reopened(tmp_path / "shot.blend")
    bpy.ops.ed.undo_push(message="before")
    first, active().delta_e = active().bake_path, 9.0
    assert bpy.ops.grating.bake() == {"FINISHED"} and bpy.ops.grating.assign() == {"FINISHED"}
    second = active().bake_path
    bpy.ops.ed.undo_push(message="renewed")
    for step, path in ((bpy.ops.ed.undo, first), (bpy.ops.ed.redo, second)):
        step()
        assert active().bake_path == path != "" and addon.lost_parts.lost([active().group]) == []
    assert first != second
