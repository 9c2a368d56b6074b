# SPDX-License-Identifier: GPL-3.0-or-later
"""A stranger's .blend, with code in every place that the extension reads, opened with auto-run of scripts off: none of
the code runs, also while the extension follows, draws, assigns, bakes, renders and saves.

Each piece of code would write a file."""

import contextlib
import os
import subprocess
import sys
from types import SimpleNamespace

import bpy
import pytest

from tests.addon.conftest import select
from tests.addon.layout import Layout, context_of
from tests.addon.worlds.made import world_with

# As a name or a text, it would run in eval, in a shell, in a format string, or in a shader's source.
NAME = "{name.__init__.__globals__}$(touch ran)%s\");open('ran.name','w')"
OPERATORS = ("assign", "bake", "mend", "why_black", "lights", "fit_world")


@pytest.fixture
def hostile(scene, grating, addon, tmp_path, monkeypatch):
    """A saved .blend whose texts, drivers, names, settings and properties are code, and modules of code beside it."""
    assert bpy.ops.grating.assign() == {"FINISHED"}
    plane, tree = bpy.data.objects["Plane"], grating.own_group
    code = f"open({str(tmp_path / 'ran.driver')!r}, 'w').write('0')"
    bpy.data.texts.new("evil.py").from_string(f"open({str(tmp_path / 'ran.text')!r}, 'w')")
    bpy.data.texts["evil.py"].use_module = True
    scene.world, background = world_with("ShaderNodeTexGradient")
    background.inputs["Strength"].driver_add("default_value").driver.expression = code
    for holder, path in ((plane, "location"), (bpy.data.objects["Sun"], "rotation_euler"), (scene, "gravity")):
        holder.driver_add(path, 0).driver.expression = code
    own = [curve for holder in (scene, *bpy.data.node_groups) for curve in drivers_of(holder)]
    assert len(own) > 10
    for curve in own:
        curve.driver.type = "SCRIPTED"
        curve.driver.expression = code
    for name in [name for name, _ in scene.items() if name.startswith("ng_")]:
        scene[f"{name}_code"] = code
    for holder in (scene, plane, tree, grating.material):
        holder["ng_made_from"] = holder["ng_version"] = holder["ng_lights"] = code
    grating.name = plane.name = bpy.data.objects["Sun"].name = NAME[:60]
    grating.summary = grating.quality = grating.bake_summary = grating.layers = grating.illuminant = code
    grating.request, grating.source = f'{{"model": "{code}"}}', NAME
    for module in ("bpy", "numpy", "json", "precompute", "OpenEXR", "sitecustomize"):
        (tmp_path / f"{module}.py").write_text(f"open({str(tmp_path / 'ran.module')!r}, 'w')\nraise SystemExit\n")
    blend = tmp_path / "hostile.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    monkeypatch.chdir(tmp_path)
    yield blend
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def drivers_of(holder):
    return list(holder.animation_data.drivers) if holder.animation_data else []


def act(addon):
    """Everything that the extension does with an open file. Refusals are fine."""
    scene = bpy.context.scene
    select(*[thing for thing in scene.objects if thing.type == "MESH"])
    scene.frame_set(2)
    bpy.context.view_layer.update()
    addon.panel.GratingPanel.draw(SimpleNamespace(layout=Layout()), context_of())
    for name in OPERATORS:
        with contextlib.suppress(RuntimeError):
            getattr(bpy.ops.grating, name)()
    bpy.context.view_layer.update()
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x = scene.render.resolution_y = 8
    bpy.ops.render.render()
    bpy.ops.wm.save_mainfile()


def ran(folder):
    return sorted(path.name for path in folder.glob("ran*"))


def test_no_code_of_a_file_runs(hostile, addon, tmp_path, capfd):
    bpy.ops.wm.open_mainfile(filepath=str(hostile), use_scripts=False)
    act(addon)
    # The child process of a bake that is not refused, and the second Blender that looks at the world.
    grating = bpy.context.scene.natural_gratings.active()
    grating.source, grating.request, grating.illuminant, grating.delta_e = "sample:flat", "", "", 9.0
    assert bpy.ops.grating.bake() == {"FINISHED"}
    assert bpy.ops.grating.fit_world() == {"FINISHED"}
    assert ran(tmp_path) == []
    # Blender itself prints a traceback for each driver that it refuses.
    assert "bl_ext" not in capfd.readouterr().err


def test_with_auto_run_on_the_same_code_runs(hostile, tmp_path):
    """So the test above can fail."""
    bpy.ops.wm.open_mainfile(filepath=str(hostile), use_scripts=True)
    bpy.context.scene.frame_set(2)
    bpy.context.view_layer.update()
    assert ran(tmp_path) == ["ran.driver", "ran.text"]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    command = [sys.executable, "-c", "import precompute"]
    subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, check=False)
    assert ran(tmp_path) == ["ran.driver", "ran.module", "ran.text"]


def test_the_extension_s_own_drivers_need_no_auto_run(scene, grating, addon, tmp_path):
    """They are simple expressions, which Blender computes without Python."""
    assert bpy.ops.grating.assign() == {"FINISHED"}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "own.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "own.blend"), use_scripts=False)
    scene = bpy.context.scene
    scripted = [curve.driver for curve in drivers_of(scene) if curve.driver.type == "SCRIPTED"]
    assert len(scripted) > 10 and all(driver.is_simple_expression for driver in scripted)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
