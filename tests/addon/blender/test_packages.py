# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender with a missing or broken package of the extension: everything else works, and functions that need the package
fail in one line and leave nothing behind. tests/precompute/base/test_packages.py tests the command line."""

import os
import sys
from types import SimpleNamespace

import bpy
import pytest

from tests.addon.conftest import reports
from tests.addon.layout import Layout, context_of

MISSING, BROKEN = "missing", "broken"
STATES = (MISSING, BROKEN)
FAULTS = {MISSING: r"it is not installed for Python 3\.\d+", BROKEN: r"cannot be loaded \(ImportError: GLIBC.*\)"}
REMEDY = "install the extension's zip for this platform, or this package for this Python"


@pytest.fixture
def spoil(tmp_path_factory, monkeypatch):
    """A function that removes packages, or shadows them; returns a folder that does so in a new Python."""

    def spoil(state, *packages):
        place = tmp_path_factory.mktemp("site")
        for package in packages:
            for name in [name for name in sys.modules if name.partition(".")[0] == package]:
                monkeypatch.delitem(sys.modules, name)
            if state == MISSING:
                monkeypatch.setitem(sys.modules, package, None)
                continue
            (place / package).mkdir()
            (place / package / "__init__.py").write_text("raise ImportError('GLIBC_2.38 not found')")
        if state == MISSING:
            (place / "sitecustomize.py").write_text(f"import sys\nsys.modules.update(dict.fromkeys({packages!r}))\n")
        monkeypatch.syspath_prepend(str(place))
        return place

    return spoil


@pytest.fixture
def spoilt_child(addon, spoil, monkeypatch):
    """A function that also spoils packages for child processes, which search NumPy's folder first."""
    start = addon.child.child_environment

    def spoil_both(state, *packages):
        environment = start()
        place = spoil(state, *packages)
        environment["PYTHONPATH"] = os.pathsep.join([str(place), environment["PYTHONPATH"]])
        monkeypatch.setattr(addon.child, "child_environment", lambda: environment)

    return spoil_both


@pytest.mark.parametrize("state", STATES)
def test_a_bake_is_assigned_without_any_package(scene, baked, spoil, state):
    spoil(state, "OpenEXR", "PIL", "xatlas")
    grating = scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "waves", str(baked)
    bpy.ops.mesh.primitive_uv_sphere_add()
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert bpy.context.object.material_slots[0].material is grating.material


@pytest.mark.night("tests/addon/operators/test_operators.py")
@pytest.mark.parametrize("state", STATES)
def test_a_bake_without_openexr_is_one_line(scene, tmp_path, spoilt_child, state, monkeypatch):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(tmp_path / "cache"))  # a bake from the cache needs no OpenEXR
    spoilt_child(state, "OpenEXR")
    bpy.ops.grating.import_height_map(filepath="sample:cd")
    with pytest.raises(RuntimeError, match=f"^Error: OpenEXR: {FAULTS[state]}; {REMEDY}$"):
        bpy.ops.grating.bake(directory=str(tmp_path / "out"))
    assert not list(tmp_path.glob("out/**/*"))


@pytest.mark.night("tests/addon/ui/test_panel.py")
@pytest.mark.parametrize("state", STATES)
def test_a_bake_needs_no_pillow(scene, tmp_path, spoilt_child, state):
    spoilt_child(state, "PIL", "xatlas")
    bpy.ops.grating.import_height_map(filepath="sample:sinusoidal")
    grating = scene.natural_gratings.active()
    grating.delta_e = 9 if state == MISSING else 9.5  # avoids the cache
    assert bpy.ops.grating.bake(directory=str(tmp_path / "out")) == {"FINISHED"}


@pytest.mark.parametrize("state", STATES)
def test_a_picture_is_not_imported_without_pillow_and_a_text_is(scene, scan, tmp_path, spoil, state):
    spoil(state, "PIL")
    with pytest.raises(RuntimeError, match=f"^Error: Pillow: {FAULTS[state]}; {REMEDY}$"):
        bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    assert len(scene.natural_gratings.items) == 0
    text = tmp_path / "heights.txt"
    text.write_text("\n".join(" ".join(str((x + y) % 7) for x in range(16)) for y in range(16)))
    assert bpy.ops.grating.import_height_map(filepath=str(text), size_um=4, height_nm=10) == {"FINISHED"}


@pytest.mark.parametrize("state", STATES)
def test_an_unwrap_without_xatlas_is_one_line_and_blender_s_own_works(scene, spoilt_child, state, capfd):
    spoilt_child(state, "xatlas")
    before = [layer.name for layer in bpy.context.object.data.uv_layers]
    with pytest.raises(RuntimeError, match=f"^Error: xatlas: {FAULTS[state]}; choose Blender's own Minimum Stretch$"):
        bpy.ops.grating.unwrap(method="XATLAS")
    assert [layer.name for layer in bpy.context.object.data.uv_layers] == before
    told = reports(lambda: bpy.ops.grating.unwrap(method="MINIMUM_STRETCH"), capfd)
    assert "Plane: unwrapped into Unwrapped" in told


@pytest.mark.parametrize("packages", [(), ("PIL",), ("OpenEXR", "PIL", "xatlas")])
def test_the_panel_says_once_what_is_missing(scene, addon, spoil, packages):
    spoil(MISSING, *packages)
    layout = Layout(folded=False)
    addon.panel.GratingPanel.draw(SimpleNamespace(layout=layout), context_of())
    named = [
        name for name in layout.noted("INFO").split("Remedy")[0].split() if name in ("OpenEXR", "Pillow", "xatlas")
    ]
    assert named == [{"PIL": "Pillow"}.get(package, package) for package in packages]


def test_the_console_says_once_what_is_missing(addon, spoil, capsys):
    addon.installation.print_missing()
    assert capsys.readouterr().err == ""
    spoil(MISSING, "PIL")
    addon.installation.print_missing()
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert told.startswith("Natural Gratings: Missing packages: Pillow (to read PNG, TIFF and BMP scans). ")
    assert told.endswith(f". Install them for this Blender's Python {sys.version_info[0]}.{sys.version_info[1]}.\n")
