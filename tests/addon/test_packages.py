# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender in which a package of the extension is broken: Assign works, Bake says so in one line or needs it not."""

import os
import sys

import bpy
import pytest


def spoil(monkeypatch, folder, *packages):
    """Put packages that cannot be loaded before those that can."""
    for package in packages:
        for name in [name for name in sys.modules if name.partition(".")[0] == package]:
            monkeypatch.delitem(sys.modules, name)
        (folder / package).mkdir()
        (folder / package / "__init__.py").write_text("raise ImportError('GLIBC_2.38 not found')")
    monkeypatch.syspath_prepend(str(folder))


def test_a_bake_is_assigned_without_openexr_and_pillow(scene, baked, tmp_path, monkeypatch):
    spoil(monkeypatch, tmp_path, "OpenEXR", "PIL", "xatlas")
    grating = scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "waves", str(baked)
    bpy.ops.mesh.primitive_uv_sphere_add()
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert bpy.context.object.material_slots[0].material is grating.material


@pytest.fixture
def spoilt_child(addon, tmp_path, monkeypatch):
    """A function that spoils packages for the process beside Blender too, which has NumPy's folder before theirs."""
    start = addon.child.child_environment

    def spoil_both(*packages):
        (tmp_path / "site").mkdir()
        spoil(monkeypatch, tmp_path / "site", *packages)
        found = start()
        found["PYTHONPATH"] = os.pathsep.join([str(tmp_path / "site"), found["PYTHONPATH"]])
        monkeypatch.setattr(addon.child, "child_environment", lambda: found)

    return spoil_both


def test_a_bake_without_openexr_is_one_line(scene, tmp_path, spoilt_child):
    spoilt_child("OpenEXR")
    bpy.ops.grating.import_height_map(filepath="sample:cd")
    told = r"OpenEXR: cannot be loaded \(ImportError: GLIBC.*\); install the extension's zip for this platform again"
    with pytest.raises(RuntimeError, match=told):
        bpy.ops.grating.bake(directory=str(tmp_path / "out"))
    assert not list(tmp_path.glob("out/**/*"))


def test_a_bake_needs_no_pillow(scene, tmp_path, spoilt_child):
    spoilt_child("PIL", "xatlas")
    bpy.ops.grating.import_height_map(filepath="sample:cd")
    grating = scene.natural_gratings.active()
    grating.delta_e = 9
    assert bpy.ops.grating.bake(directory=str(tmp_path / "out")) == {"FINISHED"}
