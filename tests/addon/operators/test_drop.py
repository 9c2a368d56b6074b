# SPDX-License-Identifier: GPL-3.0-or-later
"""Files dropped on a 3D view."""

import shutil
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from PIL import Image

from precompute.surface.readers.reader_registry import dropped, extensions
from precompute.table.atlas import read_header
from tests.hostile import instruments


def test_files_of_microscopes_may_be_dropped_on_a_3d_view(scene):
    handler = bpy.types.GRATING_FH_height_map
    assert handler.bl_file_extensions == dropped()
    # Blender keeps 511 bytes.
    assert len(dropped()) < 512
    assert {".nid", ".spm", ".001", ".gwy"} <= set(dropped().split(";"))
    assert not {".tif", ".png", ".txt"} & set(dropped().split(";"))
    area = SimpleNamespace(type="VIEW_3D")
    assert handler.poll_drop(SimpleNamespace(area=area))
    area.type = "IMAGE_EDITOR"
    assert not handler.poll_drop(SimpleNamespace(area=area))
    assert not handler.poll_drop(SimpleNamespace(area=None))
    assert handler.bl_import_operator == "grating.import_height_map"


def test_the_menu_names_a_few_formats(addon):
    """All formats would be wider than the screen."""
    drawn = []
    layout = SimpleNamespace(operator=lambda name, text: drawn.append((name, text)))
    addon.import_files.menu_entries(SimpleNamespace(layout=layout), None)
    (name, text), _ = drawn
    assert name == "grating.import_height_map"
    named = text.removeprefix("Height Map (").removesuffix(", ...)").split(", ")
    assert len(named) > 2 and set(named) <= set(extensions())


@pytest.mark.parametrize("make, name", [(instruments.nanoscope, "drop.spm"), (instruments.gsf, "drop.gsf")])
def test_a_file_that_is_dropped_is_imported_at_once(scene, tmp_path, make, name):
    x = np.arange(64) * 50e-9
    (tmp_path / name).write_bytes(make(50e-9 * np.sin(2 * np.pi * x / 800e-9) * np.ones((64, 1)), 50e-9))
    done = bpy.ops.grating.import_height_map("INVOKE_DEFAULT", filepath=str(tmp_path / name))
    assert done == {"FINISHED"}
    grating = scene.natural_gratings.active()
    assert grating.name == "drop"
    assert grating.summary.startswith("3.2 x 3.2 um\nrelief ") and grating.summary.endswith(" at 0 deg")


def active():
    """The active grating, looked up again because undo frees Python's references."""
    return bpy.context.scene.natural_gratings.active()


def relief_of_the_grid(shared_data):
    """The relief in metres of the grid's picture, 302.626506663 nm from black to white, without its plane."""
    with Image.open(shared_data / "nanosurf" / "grid_16bit.png") as picture:
        height = np.asarray(picture, dtype=float) / 65535 * 302.626506663e-9
    y, x = np.mgrid[: height.shape[0], : height.shape[1]]
    planes = np.stack([np.ones(height.size), y.ravel(), x.ravel()], axis=1)
    return np.ptp(height.ravel() - planes @ np.linalg.lstsq(planes, height.ravel(), rcond=None)[0])


# Real files, named as by microscopes, and their levelled relief: the first from Gwyddion's export
# (../shared/data/SOURCES.md, in whole thousandths of a nanometre), the grid's from its picture, in steps of 0.005 nm.
@pytest.mark.short("grid.nid")
@pytest.mark.parametrize(("file", "name", "relief_m"), [
    ("formats/st_di-3.di", "skin.spm", lambda _: 408.830e-9), ("nanosurf/grid.nid", "grid.nid", relief_of_the_grid),
])  # fmt: skip
def test_a_real_scan_is_dropped_previewed_levelled_baked_and_undone(
    addon, scene, shared_data, tmp_path, file, name, relief_m
):
    addon.levelling.stop()
    shutil.copy(shared_data / file, tmp_path / name)
    bpy.ops.ed.undo_push(message="before")

    def step(message):
        bpy.ops.ed.undo_push(message=message)

    def previewed():
        assert addon.levelling.shown(active()) is None
        addon.levelling.refresh()
        return addon.levelling.shown(active()).preview

    # What Blender passes to the operator for a dropped file.
    dropped_file = {"filepath": str(tmp_path / name), "directory": f"{tmp_path}/", "files": [{"name": name}]}
    assert bpy.ops.grating.import_height_map("INVOKE_DEFAULT", **dropped_file) == {"FINISHED"}
    active().delta_e = 6
    step("import")
    assert active().name == name.partition(".")[0] and active().quality
    first = previewed()
    assert first.after.range_m == pytest.approx(relief_m(shared_data), abs=1e-11)
    assert first.before.range_m > first.after.range_m
    bpy.ops.grating.add_step(kind="dust")
    active().steps[1].threshold = 6
    step("level")
    assert any("dust:6" in line for line in previewed().told)
    assert bpy.ops.grating.bake(directory=str(tmp_path / "bake")) == {"FINISHED"}
    step("bake")
    _, record = read_header(active().baked_file())
    assert record["request"]["levelling"] == ["plane", "dust:6"]
    assert record["request"]["scans"][0]["source"] == name

    bpy.ops.ed.undo()  # undoes the bake, which the grating remembers
    assert active().levelling == "plane,dust:6" and active().bake_path
    bpy.ops.ed.undo()
    assert active().levelling == "plane" and not active().bake_path
    assert addon.levelling.shown(active()).preview is first
    bpy.ops.ed.undo()
    assert active() is None
    for _ in range(3):
        bpy.ops.ed.redo()
    assert active().levelling == "plane,dust:6" and active().baked_file().is_file()
