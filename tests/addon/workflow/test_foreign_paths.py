# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths in a .blend that Blender on Windows saved, and paths that lead nowhere on this computer."""

import os
import shutil
from pathlib import Path

import bpy
import pytest

from tests.addon.conftest import select

pytestmark = pytest.mark.skipif(os.sep != "/", reason="on Windows these are own paths")


@pytest.fixture
def beside(scene, baked, scan, tmp_path):
    """A saved .blend with its scan and its bake beside it. The plane is selected."""
    shutil.copy(scan, tmp_path)
    shutil.copytree(baked.parent, tmp_path / "bakes")
    made = scene.natural_gratings.items.add()
    made.name, made.bake_path, made.source = "waves", "//bakes/waves.exr", "//waves.png"
    made.size_um, made.height_nm, made.delta_e = 4, 100, 6
    scene.natural_gratings.active_index = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    select(bpy.data.objects["Plane"])
    yield scene.natural_gratings.active()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def active():
    return bpy.context.scene.natural_gratings.active()


def test_backslashes_of_windows_are_separators(beside, addon, tmp_path, monkeypatch):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(tmp_path / "cache"))
    beside.bake_path, beside.source = "//bakes\\waves.exr", "//.\\waves.png"
    assert beside.baked_file() == tmp_path / "bakes" / "waves.exr"
    assert not addon.finding_bakes.is_lost(beside)
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert bpy.ops.grating.bake() == {"FINISHED"}


def test_unpacked_pictures_with_backslashes_are_whole(beside, addon, tmp_path):
    assert bpy.ops.grating.assign() == {"FINISHED"}
    for image in bpy.data.images:
        if image.packed_file is not None:
            image.unpack(method="WRITE_LOCAL")
            image.filepath = "//" + image.filepath[2:].replace("/", "\\")
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    group = active().own_group
    pictures = [image for image in bpy.data.images if image.source == "FILE"]
    assert [addon.pictures.fault_of(image) for image in pictures] == [""] * len(pictures) and len(pictures) >= 2
    assert not addon.lost_parts.lost_of_own(group)


def test_a_file_with_a_backslash_in_its_name_stays_itself(beside, tmp_path):
    shutil.copy(tmp_path / "bakes" / "waves.exr", tmp_path / "bakes\\waves.exr")
    beside.bake_path = "//bakes\\waves.exr"
    assert beside.baked_file() == tmp_path / "bakes\\waves.exr"


@pytest.mark.night("test_unpacked_pictures_with_backslashes_are_whole")
@pytest.mark.parametrize("drive", ["C:\\", "c:/", "\\\\server\\share\\"])
def test_a_path_of_a_windows_drive_costs_one_line(beside, addon, drive):
    """The packed bake stays in use; a new bake needs the scan."""
    assert bpy.ops.grating.assign() == {"FINISHED"}
    beside.bake_path = f"{drive}bakes\\skin.exr"
    with pytest.raises(
        addon.child.GratingError, match=r"waves: its bake skin\.exr is gone from the folder bakes; press Bake"
    ):
        beside.baked_file()
    beside.source = f"{drive}waves.png"
    with pytest.raises(RuntimeError) as refusal:
        bpy.ops.grating.bake()
    assert str(refusal.value).strip() == (
        f"Error: {drive}waves.png: a path of Windows, not of this computer; choose it here again"
    )
    assert bpy.ops.grating.assign() == {"FINISHED"}


def test_a_bake_does_not_make_a_folder_named_like_a_server(beside, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(RuntimeError, match="a path of Windows, not of this computer"):
        bpy.ops.grating.bake(directory="\\\\server\\share\\bakes")
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.night("tests/addon/workflow/test_restoring_bakes.py")
def test_a_folder_without_slashes_is_recorded_whole(beside, tmp_path, monkeypatch):
    """A relative folder is of the working folder, which the next Blender does not share."""
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    assert bpy.ops.grating.bake(directory="plain") == {"FINISHED"}
    assert Path(active().bake_path) == tmp_path / "plain" / "waves.exr"
