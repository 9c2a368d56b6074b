# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample scenes: their scripts write the listed objects, and a scene is made end to end."""

import importlib
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from PIL import Image

from precompute.presets.presets import read_preset
from sample_scenes import animal, discs, products, relight, scenes, sets
from sample_scenes.demo import Stopwatch


@pytest.mark.parametrize("name", ["cd", "shed"])
def test_a_script_writes_what_is_assigned(name, tmp_path):
    scene, file = scenes.SCENES[name], str(tmp_path / "scene.blend")
    script = importlib.import_module(f"sample_scenes.{scene.script.removesuffix('.py')}")
    script.main(["--output", file, *scene.options])
    bpy.ops.wm.open_mainfile(filepath=file)
    for shown in scene.bakes:
        assert bpy.data.objects[shown].data.uv_layers
    assert bpy.context.scene.camera


def test_the_disc_is_of_the_presets_matter():
    assert scenes.SCENES["cd"].matter == str(read_preset("cd").request.matter)


@pytest.mark.short("disc")
@pytest.mark.parametrize(
    ("name", "things"),
    [("disc", ["CD", "Lying CD"]), ("bottle", ["Sticker", "Sticker.001"]), ("beetle", ["Pronotum", "Wing Case Left"])],
)
def test_a_product_wears_the_grating_that_the_operators_put_on(addon, name, things, tmp_path, monkeypatch):
    monkeypatch.setattr(products, "bake_well", lambda: None)
    bpy.context.scene.natural_gratings.items.clear()
    products.main(["--output", str(tmp_path / "a.blend"), "--product", name])
    (grating,) = bpy.context.scene.natural_gratings.items
    shown = {thing.name for thing in addon.material.shown_by(grating.group)}
    assert set(things) <= shown and "Table" not in shown


@pytest.mark.night("test_a_turntable_goes_round_once_at_an_even_pace")
@pytest.mark.parametrize("view", list(animal.VIEWS))
def test_views_of_the_animal(addon, view, tmp_path):
    panorama = tmp_path / "room.exr"
    image = bpy.data.images.new("Room", 8, 4, float_buffer=True)
    image.filepath_raw, image.file_format = str(panorama), "OPEN_EXR"
    image.save()
    options = ["--view", view, "--faces", "11000", "--panorama", str(panorama)]
    animal.main(["--output", str(tmp_path / "a.blend"), *options])
    ground = {"turntable": "Plate"}.get(animal.VIEWS[view].ground, "Soil")
    assert {"Snake", ground, "Camera"} <= set(bpy.data.objects.keys())
    lamps = [o for o in bpy.data.objects if o.type == "LIGHT"]
    assert len(lamps) == {"suns": len(animal.SUNS["XENOPELTIS"]), "one sun": 1}.get(animal.VIEWS[view].light, 0)


def test_a_turntable_goes_round_once_at_an_even_pace(addon, tmp_path):
    animal.main(["--output", str(tmp_path / "a.blend"), "--view", "turntable", "--faces", "11000"])
    scene = bpy.context.scene
    angles = []
    for frame in range(1, animal.TURNTABLE_FRAMES + 2):
        scene.frame_set(frame)
        angles.append(bpy.data.objects["Turntable"].rotation_euler.z)
    np.testing.assert_allclose(np.diff(angles), 2 * np.pi / animal.TURNTABLE_FRAMES, rtol=1e-4)


def test_a_room_without_its_panorama_is_refused(capsys):
    with pytest.raises(SystemExit):
        animal.main(["--output", "a.blend", "--view", "room"])
    assert "sample_scenes.room" in capsys.readouterr().err


@pytest.mark.parametrize("world", scenes.WORLDS)
def test_another_light_takes_the_place_of_the_suns(world, monkeypatch):
    monkeypatch.setattr(relight, "_ROWS", 32)
    scene = bpy.context.scene
    discs.build(scene)
    relight.relight(scene, world)
    lamps = [thing.data for thing in scene.objects if thing.type == "LIGHT"]
    assert [lamp.type for lamp in lamps] == ["AREA"] * (world == "area")
    nodes = scene.world.node_tree.nodes
    shown = {"sky": "TEX_SKY", "area": "BACKGROUND"}.get(world, "TEX_ENVIRONMENT")
    assert shown in {node.type for node in nodes}
    if world == "sky":
        sky = next(node for node in nodes if node.type == "TEX_SKY")
        _, azimuth, elevation, _ = discs.KEYS[0]
        assert np.degrees((sky.sun_rotation, sky.sun_elevation)) == pytest.approx((90 - azimuth, elevation), abs=0.01)
    if world == "area":
        assert nodes["Background"].inputs["Strength"].default_value == 0
    assert list(relight.WORLDS) == list(scenes.WORLDS)
    assert list(sets.SETS) == list(scenes.SETS)


def test_scenes_without_suns_are_not_lit_anew(tmp_path, monkeypatch, capsys):
    made = []
    monkeypatch.setattr(scenes, "make", lambda name, *_, **__: made.append(name))
    assert scenes.main(["--output", str(tmp_path), "--world", "studio"]) == 0
    assert set(made) == set(scenes.SCENES) - {"room", "shed", *scenes.PRODUCTS}
    with pytest.raises(SystemExit):
        scenes.main(["--output", str(tmp_path), "--world", "studio", "--scene", "shed"])
    assert "room, shed have not" in capsys.readouterr().err


@pytest.mark.night("test_a_script_writes_what_is_assigned")
def test_a_scene_is_made_end_to_end(tmp_path):
    version = ".".join(str(part) for part in bpy.app.version[:2])
    asked = SimpleNamespace(
        width=16, engine="cycles", samples=1, bpy=version, blender=None, lights="lamps", world="area", no_shadows=True
    )
    picture = scenes.make("cd", scenes.SCENES["cd"], tmp_path, arguments=asked, watch=Stopwatch())
    assert Image.open(picture).size == (16, 9) and picture.name == "cd_area_cycles.png"
    bpy.ops.wm.open_mainfile(filepath=str(picture.with_suffix(".blend")))
    assert "Area" in bpy.data.objects and "Key" not in bpy.data.objects
