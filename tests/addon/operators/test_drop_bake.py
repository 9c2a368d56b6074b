# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes and presets that are dropped on a 3D view or a shader editor."""

import json
import shutil
from types import SimpleNamespace

import bpy
import pytest

from precompute.presets.presets import FOLDER
from precompute.table.sample_set import path_beside


def dropped(*paths):
    """What Blender passes to an operator for dropped files."""
    names = [{"name": path.name} for path in paths]
    return {"filepath": str(paths[0]), "directory": f"{paths[0].parent}/", "files": names}


def names(scene):
    return [grating.name for grating in scene.natural_gratings.items]


@pytest.mark.parametrize(("handler", "operator", "ending"), [
    ("GRATING_FH_bake", "grating.load_bake", ".exr"), ("GRATING_FH_preset", "grating.load_preset", ".json"),
])  # fmt: skip
def test_the_handlers_take_their_files_in_3d_views_and_shader_editors(scene, handler, operator, ending):
    handler = getattr(bpy.types, handler)
    assert (handler.bl_import_operator, handler.bl_file_extensions) == (operator, ending)
    for ui_type, takes in (("VIEW_3D", True), ("ShaderNodeTree", True), ("GeometryNodeTree", False), ("UV", False)):
        assert handler.poll_drop(SimpleNamespace(area=SimpleNamespace(ui_type=ui_type))) == takes
    assert not handler.poll_drop(SimpleNamespace(area=None))


def test_blender_keeps_its_own_handlers_for_pictures(scene):
    """With several handlers for a file, Blender asks which one to use. So a picture in an .exr can still be dropped."""
    for name in ("VIEW3D_FH_empty_image", "VIEW3D_FH_camera_background_image", "NODE_FH_image_node"):
        assert ".exr" in getattr(bpy.types, name).bl_file_extensions.split(";")


def test_a_bake_that_is_dropped_is_loaded_at_once(scene, baked):
    assert bpy.ops.grating.load_bake("INVOKE_DEFAULT", **dropped(baked)) == {"FINISHED"}
    assert scene.natural_gratings.active().bake_path == str(baked)
    assert names(scene) == ["waves"]


def test_both_files_of_a_bake_are_one_grating(scene, baked):
    for files in ((baked, path_beside(baked)), (path_beside(baked), baked)):
        scene.natural_gratings.items.clear()
        assert bpy.ops.grating.load_bake("INVOKE_DEFAULT", **dropped(*files)) == {"FINISHED"}
        assert names(scene) == ["waves"]


def test_a_picture_that_is_no_bake_is_refused_in_one_line(scene, baked, tmp_path):
    image = bpy.data.images.new("Picture", 4, 4, float_buffer=True)
    image.filepath_raw, image.file_format = str(tmp_path / "picture.exr"), "OPEN_EXR"
    image.save()
    shutil.copy(baked, tmp_path / "waves.exr")
    for files in ([tmp_path / "picture.exr"], [tmp_path / "waves.exr", tmp_path / "picture.exr"]):
        with pytest.raises(
            RuntimeError, match="picture.exr: not a bake, but another OpenEXR file; give the .exr that a bake"
        ) as refusal:
            bpy.ops.grating.load_bake("INVOKE_DEFAULT", **dropped(*files))
        assert str(refusal.value).strip().count("\n") == 0
        assert names(scene) == []  # all or none


def test_a_preset_of_one_s_own_is_added(scene, tmp_path):
    record = json.loads((FOLDER / "gold_foil.json").read_text())
    record |= {"title": "My Foil", "inputs": {"Roughness": 0.3}}
    (tmp_path / "foil.json").write_text(json.dumps(record))
    assert bpy.ops.grating.load_preset("INVOKE_DEFAULT", **dropped(tmp_path / "foil.json")) == {"FINISHED"}
    grating = scene.natural_gratings.active()
    assert grating.name == "My Foil" and grating.source == record["request"]["scans"][0]["source"]
    assert grating.look.inputs_for(grating.name) == {"Roughness": 0.3}
    shutil.copy(FOLDER / "cd.json", tmp_path / "CD.JSON")
    both = dropped(tmp_path / "foil.json", tmp_path / "CD.JSON")
    assert bpy.ops.grating.load_preset("INVOKE_DEFAULT", **both) == {"FINISHED"}
    assert names(scene) == ["My Foil", "CD"]


@pytest.mark.parametrize(("text", "told"), [
    ("{", "any.json: not JSON that can be used .*; compare it with a preset that works"),
    ("[]", "any.json: holds no preset; give an object with title, request"),
    ('{"scripts": {}}', "any.json: scripts: no such key of a preset; there are title, "),
    ('{"title": "x"}', "any.json: request: is missing; add `request`"),
    ('{"a\\nb": 1}', "any.json: a.*b: no such key of a preset"),
])  # fmt: skip
def test_another_json_file_is_refused_in_one_line(scene, tmp_path, text, told):
    (tmp_path / "any.json").write_text(text)
    shutil.copy(FOLDER / "cd.json", tmp_path / "cd.json")
    with pytest.raises(RuntimeError, match=told) as refusal:
        bpy.ops.grating.load_preset(**dropped(tmp_path / "cd.json", tmp_path / "any.json"))
    assert str(refusal.value).strip().count("\n") == 0
    assert names(scene) == []


def test_a_drop_is_undone(scene, baked):
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.grating.load_bake("INVOKE_DEFAULT", **dropped(baked))
    bpy.ops.ed.undo_push(message="drop")
    bpy.ops.ed.undo()
    assert names(bpy.context.scene) == []
    bpy.ops.ed.redo()
    assert names(bpy.context.scene) == ["waves"]
