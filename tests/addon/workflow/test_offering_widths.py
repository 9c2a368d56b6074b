# SPDX-License-Identifier: GPL-3.0-or-later
"""The import dialog offers a picture's width, from its name or from the last import, and says where it comes from."""

import os
import shutil
from types import SimpleNamespace

import bpy
import pytest

from tests.addon.conftest import reports


@pytest.fixture(autouse=True)
def new_session(addon):
    addon.importing._last.clear()
    yield
    addon.importing._last.clear()


@pytest.fixture
def dialog(addon):
    """The dialog with a file chosen in it; `size_um` is what the artist typed before."""

    def chosen(*paths, size_um=0.0):
        operator = addon.import_files.ImportHeightMap
        # As Blender's file dialog gives them: one path, or a folder with the names of several files.
        files = [SimpleNamespace(name=path.name) for path in paths]
        held = SimpleNamespace(filepath=str(paths[0]), directory=str(paths[0].parent), files=files)
        held.size_um, held.offered_um, held.origin = size_um, 0.0, ""
        held.check = lambda: operator.check(held, bpy.context)
        held.check()
        return held

    return chosen


@pytest.fixture
def named(scan, tmp_path):
    """Copies the scan under other names."""
    return lambda name: shutil.copy(scan, tmp_path / name)


def import_in_dialog(path, **more):
    return bpy.ops.grating.import_height_map(filepath=str(path), height_nm=100, in_dialog=True, **more)


def test_the_name_s_width_is_a_default_in_the_field(dialog, named):
    found = dialog(named("skin_10um.png"))
    assert (found.size_um, found.origin) == (10, "from the file's name")
    found.filepath = str(named("skin_20um.png"))
    assert found.check() and found.size_um == 20


def test_a_typed_width_stays(dialog, named):
    assert dialog(named("skin_10um.png"), size_um=7.0).size_um == 7
    found = dialog(named("skin_10um.png"))
    found.size_um = 8.0
    assert not found.check() and found.size_um == 8


def test_the_report_names_the_guess(scene, named, capfd):
    told = reports(lambda: import_in_dialog(named("skin_10um.png")), capfd)
    assert "skin_10um: 10 x 10 um" in told and "width 10 um from the file's name" in told
    assert scene.natural_gratings.active().size_um == 10


def test_a_typed_width_is_no_guess(scene, named, capfd):
    told = reports(lambda: import_in_dialog(named("skin_10um.png"), size_um=4), capfd)
    assert "4 x 4 um" in told and "from the file" not in told


def test_the_last_width_is_offered_where_the_name_says_none(scene, dialog, scan, named, capfd):
    assert dialog(scan).size_um == 0
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    assert dialog(scan).size_um == 4 and dialog(named("skin_10um.png")).size_um == 10
    told = reports(lambda: import_in_dialog(named("other.png")), capfd)
    assert "width 4 um as in your last import" in told


def test_a_file_that_stores_its_width_keeps_it(scene, shared_data, tmp_path, dialog, scan, capfd):
    path = shutil.copy(shared_data / "nanosurf" / "grid.nid", tmp_path / "grid_500um.nid")
    assert dialog(path).size_um == 0
    # Chosen together with a picture: the picture alone takes the offered width.
    picture = shutil.copy(scan, tmp_path / "waves_4um.png")
    assert dialog(path, picture).size_um == 4
    told = reports(lambda: bpy.ops.grating.import_height_map(filepath=str(path), in_dialog=True), capfd)
    assert "500 x" not in told and "width" not in told


def test_names_that_differ_offer_nothing(dialog, named):
    assert dialog(named("a_10um.png"), named("b_20um.png")).size_um == 0
    assert dialog(named("a_10um.png"), named("b.png")).size_um == 0
    assert dialog(named("a_10um.png"), named("b_10um.png")).origin == "from the files' names"


def test_a_script_gets_no_guess(scene, named):
    with pytest.raises(RuntimeError, match=r"Width \(um\) in the import dialog"):
        bpy.ops.grating.import_height_map(filepath=str(named("skin_10um.png")), height_nm=100)


def test_several_files_name_the_guess_on_every_line(scene, named, tmp_path, capfd):
    files = [{"name": named(name).name} for name in ("a_10um.png", "b_10um.png")]
    given = {"directory": str(tmp_path), "files": files, "height_nm": 100, "in_dialog": True}
    told = reports(lambda: bpy.ops.grating.import_height_map(**given), capfd)
    assert told.count("width 10 um from the files' names") == 2
    told = reports(lambda: bpy.ops.grating.import_height_map(several="AVERAGE", **given), capfd)
    assert told.count("width 10 um from the files' names") == 1


def test_a_file_that_cannot_be_read_offers_nothing(dialog, tmp_path):
    assert dialog(tmp_path / "gone_10um.png").size_um == 0
    assert dialog(tmp_path).size_um == 0


def test_a_refused_file_is_offered_again_with_what_was_typed(scene, addon, named):
    """After an import that lacks its height, the dialog starts at the file; after one that works, in its folder."""
    dialog, path = type("ImportHeightMap", (), {})(), named("other.png")
    with pytest.raises(RuntimeError, match="Height"):
        bpy.ops.grating.import_height_map(filepath=str(path), size_um=4, in_dialog=True)
    addon.import_files.start_where_left(dialog)
    assert (dialog.filepath, dialog.size_um) == (str(path), 4)
    import_in_dialog(path, size_um=4)
    addon.import_files.start_where_left(dialog)
    assert dialog.filepath == str(path.parent) + os.sep
