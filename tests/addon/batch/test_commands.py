# SPDX-License-Identifier: GPL-3.0-or-later
"""`--command grating`: exit statuses, one-line errors, and saved files."""

import re
import shutil
import sys

import bpy
import numpy as np
import pytest
from PIL import Image

from precompute.bake.cache import Cache
from tests.printed_commands import PAGES, printed


def fault(capfd, addon, *arguments) -> str:
    """The single error line of a command that fails."""
    capfd.readouterr()
    assert addon.commands.execute([str(a) for a in arguments]) != 0
    lines = [line for line in capfd.readouterr().err.splitlines() if line.startswith("error:")]
    assert len(lines) == 1
    return lines[0]


def test_import_assign_and_render(addon, scene, scan, baked, tmp_path):
    blend, picture = tmp_path / "plane.blend", tmp_path / "plane.png"
    picture_options = ["--size-um", "4", "--height-nm", "100"]
    assert addon.commands.execute(["import", str(scan), *picture_options, "--save", str(blend)]) == 0
    assert blend.is_file()
    assert addon.commands.execute(["assign", str(baked), "--object", "Plane", "--save", str(blend)]) == 0
    assert bpy.data.objects["Plane"].active_material.name == "Diffraction waves"
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, 0, 2)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    size = ["--width", "32", "--height", "32", "--samples", "1", "--engine", "cycles"]
    assert addon.commands.execute(["render", "-o", str(picture), *size]) == 0
    assert picture.is_file()


def test_faults_are_one_line(addon, scene, baked, tmp_path, capfd):
    assert "no such object" in fault(
        capfd, addon, "assign", baked, "--object", "Nobody", "--save", tmp_path / "a.blend"
    )
    assert "no bake there" in fault(capfd, addon, "assign", tmp_path, "--object", "Plane")
    assert "sample" in fault(capfd, addon, "import", "sample:unknown", "--save", tmp_path / "a.blend")
    bpy.context.scene.camera = None
    assert "no camera" in fault(capfd, addon, "render", "-o", tmp_path / "a.png")
    assert "see `" in fault(capfd, addon, "paint")
    assert list(tmp_path.iterdir()) == []


def test_verbs_understand_the_commands_that_pages_print(addon):
    lines = [words for page in PAGES for words in printed(page) if words[0] == "blender" and "grating" in words]
    for words in lines:
        arguments = words[words.index("grating") + 1 :]
        addon.commands.build_parser(arguments).parse_args(arguments)
    assert {words[words.index("grating") + 1] for words in lines} >= set(addon.commands.VERBS) - {"import"}


def test_no_verb_runs_on_another_file_than_the_one_asked_for(addon, scene, tmp_path, capfd, monkeypatch):
    """If Blender cannot open a file, it keeps the startup scene, or the file before it, and still runs the command."""
    blend, missing, cut = (tmp_path / name for name in ("plane.blend", "missing.blend", "cut.blend1"))
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    cut.write_bytes(blend.read_bytes()[:1000])
    picture = tmp_path / "a.png"
    for asked, why in (
        ([missing], "missing.blend: there is no such file"),
        ([blend, missing], "missing.blend: there is no such file"),
        ([blend, cut], "cut.blend1: Blender did not open it"),
        ([missing, "--python", "make.py"], "missing.blend: there is no such file"),
    ):
        words = ["blender", "--background", *map(str, asked), "--command", "grating"]
        monkeypatch.setattr(sys, "argv", words)
        for verb in (["render", "-o", picture], ["light-rig"], ["cache", "list"]):
            assert why in fault(capfd, addon, *verb)
    for asked in ([blend], [cut, "--python", "open_plane.py"], []):
        monkeypatch.setattr(sys, "argv", ["blender", "--background", *map(str, asked), "--command", "x.blend"])
        assert addon.commands.execute(["cache", "list"]) == 0
    assert not picture.exists()
    bpy.ops.wm.read_homefile(use_empty=True)


def test_a_name_of_two_gratings_is_refused(addon, scene, grating):
    other = scene.natural_gratings.items.add()
    other.name = grating.name
    with pytest.raises(addon.child.GratingError, match="--grating waves: several gratings have this name"):
        addon.shared_options.chosen_grating(scene, "waves")
    other.name = "other"
    assert addon.shared_options.chosen_grating(scene, "waves") == grating


def test_assign_over_the_own_material_with_settings(addon, scene, baked, tmp_path):
    plane, blend = bpy.data.objects["Plane"], str(tmp_path / "plane.blend")
    own = bpy.data.materials.new("Own")
    plane.data.materials.append(own)
    asked = ["--over", "--no-shadows", "--set", "IOR=2", "--set", "Rotation=90", "--save", blend]
    assert addon.commands.execute(["assign", str(baked), "--object", "Plane", *asked]) == 0
    assert plane.active_material == own
    diffraction = next(node for node in own.node_tree.nodes if node.label == "Diffraction")
    assert diffraction.inputs["IOR"].default_value == 2
    assert diffraction.inputs["Rotation"].default_value == pytest.approx(np.pi / 2)
    assert not scene.natural_gratings.active().shadows
    assert "ShaderNodeRaycast" not in {node.bl_idname for node in diffraction.node_tree.nodes}


def test_assign_fits_the_frames_of_an_animated_world(addon, scene, baked, tmp_path, capfd, monkeypatch):
    """A still world is refused, and nothing is saved."""
    asked = ["assign", str(baked), "--object", "Plane", "--fit-frames", "--save", tmp_path / "plane.blend"]
    scene.world = None
    assert "it is not animated; press Fit World instead" in fault(capfd, addon, *asked)
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr(addon.material_verbs, "fit_frames", lambda scene, progress: f"{scene.frame_end} frames fitted")
    assert addon.commands.execute(list(map(str, asked))) == 0
    assert f"{scene.frame_end} frames fitted" in capfd.readouterr().out


def test_a_named_object_need_not_be_selectable(addon, scene, baked, tmp_path):
    """Batches also name locked or hidden objects."""
    plane = bpy.data.objects["Plane"]
    for name, setting in (("Locked", "hide_select"), ("Hidden", "hide_viewport")):
        other = plane.copy()
        other.name, other.data = name, plane.data.copy()
        scene.collection.objects.link(other)
        setattr(other, setting, True)
    bpy.context.view_layer.update()
    named = [word for name in ("Locked", "Hidden") for word in ("--object", name)]
    blend = str(tmp_path / "plane.blend")
    assert addon.commands.execute(["assign", str(baked), *named, "--save", blend]) == 0
    for name in ("Locked", "Hidden"):
        assert bpy.data.objects[name].active_material.name == "Diffraction waves"
    assert plane.active_material is None


def test_settings_reach_one_grating_alone(addon, scene, baked, tmp_path):
    plane, blend = bpy.data.objects["Plane"], str(tmp_path / "plane.blend")
    save = ["--object", "Plane", "--save", blend]
    assert addon.commands.execute(["assign", str(baked), "--set", "Rotation=30", *save]) == 0
    first = plane.active_material
    plane.data.materials.append(None)
    plane.active_material_index = 1
    shutil.copy(baked, tmp_path / "second.exr")
    assert addon.commands.execute(["assign", str(tmp_path / "second.exr"), "--set", "Rotation=90", *save]) == 0
    turns = [
        addon.material.diffraction_nodes(material)[0].inputs["Rotation"].default_value
        for material in (first, plane.active_material)
    ]
    assert turns == pytest.approx([np.pi / 6, np.pi / 2])


def test_a_file_set_to_video_at_half_size_renders_a_whole_picture(addon, scene, tmp_path):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    settings, picture = scene.render.image_settings, tmp_path / "frame.png"
    if bpy.app.version >= (5, 0, 0):
        settings.media_type = "VIDEO"
    settings.file_format = "FFMPEG"
    scene.render.resolution_percentage = 50
    size = ["--width", "32", "--height", "16", "--samples", "1", "--engine", "cycles"]
    assert addon.commands.execute(["render", "-o", str(picture), *size]) == 0
    assert Image.open(picture).size == (32, 16)


@pytest.mark.night("test_places_that_cannot_be_written")
def test_a_bake_without_its_sample_set_is_told_and_anothers_refused(addon, scene, baked, tmp_path, capfd):
    alone = tmp_path / "waves.exr"
    shutil.copy(baked, alone)
    assert addon.commands.execute(["assign", str(alone), "--object", "Plane", "--save", str(tmp_path / "a.blend")]) == 0
    assert "only lamps light it, because its bake has no .lobes.exr" in capfd.readouterr().out
    words = ["sample:cd", "--delta-e", "9", "--coherence-um", "3"]
    other = addon.child.Job(
        "bake", words, tmp_path / "cd", deadline=addon.child.Deadline(600, addon.child.GratingError("", "", ""))
    )
    other.wait()
    shutil.copy(tmp_path / "cd" / "cd.lobes.exr", tmp_path / "waves.lobes.exr")
    assert "of another bake than waves.exr" in fault(capfd, addon, "assign", alone, "--object", "Plane")


def test_linked_duplicates_are_unwrapped_once(addon, scene, tmp_path):
    plane = bpy.data.objects["Plane"]
    scene.collection.objects.link(plane.copy())
    for thing in scene.objects:
        thing.select_set(thing.type == "MESH")
    before = len(plane.data.uv_layers)
    blend = str(tmp_path / "plane.blend")
    assert addon.commands.execute(["unwrap", "--method", "minimum-stretch", "--save", blend]) == 0
    assert len(plane.data.uv_layers) == before + 1


def test_settings_that_there_are_not(addon, scene, baked, tmp_path, capfd):
    refused = {"Gloss=1": "no such input", "IOR=0.5": "from 1 to 3", "IOR=nan": "from 1 to 3", "IOR": "from 1 to 3"}
    refused["Rotation=1e9"] = "degrees"
    for setting, why in refused.items():
        asked = ["--object", "Plane", "--set", setting, "--save", tmp_path / "a.blend"]
        assert why in fault(capfd, addon, "assign", baked, *asked)
    assert bpy.data.objects["Plane"].active_material is None
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["picture.jpg", "picture"])
def test_a_picture_of_another_kind_is_refused(addon, scene, tmp_path, capfd, name):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.scene.camera = camera
    assert "neither PNG nor EXR" in fault(capfd, addon, "render", "-o", tmp_path / name)


def options(addon, operator, *words):
    """What a verb's options mean to the operator whose properties they are."""
    return addon.operator_options.values(addon.commands.build_parser(words).parse_args(words), operator)


def test_options_are_an_operator_s_properties(addon, capfd):
    """With its defaults, words for enumerations, degrees for angles, and its limits."""
    sticker, rig, unwrap = addon.add_things.AddSticker, addon.light.AddLightRig, addon.direction.Unwrap
    assert options(addon, sticker, "sticker") == {"filepath": "", "size": 0.5, "rotation": 0.0}
    assert options(addon, sticker, "sticker", "--rotation=-90")["rotation"] == -np.pi / 2
    assert options(addon, rig, "light-rig", "--softness", "0.01") == {"kind": "SUN", "strength": 1.0, "softness": 0.01}
    assert options(addon, unwrap, "unwrap", "--method", "minimum-stretch")["method"] == "MINIMUM_STRETCH"
    assert "give a number from -360 to 360" in fault(capfd, addon, "sticker", "--rotation", "361")
    assert "give a whole number from 16 to 32768" in fault(capfd, addon, "unwrap", "--size", "15")
    assert "is empty; give a name" in fault(capfd, addon, "hologram", "sunburst", "--picture=")
    assert addon.commands.execute(["light-rig", "--help"]) == 0
    assert "strength of all lamps. At 1, a 50 % grey surface" in " ".join(capfd.readouterr().out.split())


# Words that no option accepts as a number, and paths that cannot be written.
NO_NUMBERS = (
    "nan",
    "inf",
    "1e-308",
    "1e400",
    "-1e3",
    "",
    "--",
    "1_000",
    "٣",
    "\udcff",
    "9" * 5000,
    "3\n4",
    "x" * 10**5,
)


@pytest.mark.parametrize(("verb", "option"), [
    ("import", "--size-um"), ("import", "--height-nm"), ("bake", "--size-um"), ("bake", "--delta-e"),
    ("bake", "--coherence-um"), ("render", "--samples"), ("render", "--width"), ("render", "--height"),
])  # fmt: skip
def test_no_verb_takes_another_number(addon, scene, tmp_path, capfd, verb, option):
    line = {"import": ["sample:flat"], "bake": ["sample:flat", "-o", tmp_path], "render": ["-o", tmp_path / "a.png"]}
    for value in NO_NUMBERS:
        for given in ([option, value], [f"{option}={value}"]):
            told = fault(capfd, addon, verb, *line[verb], *given)
            assert option in told and len(told) < 600
    assert list(tmp_path.iterdir()) == [] and not scene.natural_gratings.items


@pytest.mark.parametrize("argv", [
    ["assign", ""], ["assign", "a.exr", "--object", ""], ["assign", "a.exr", "--save="], ["bake", "", "-o", "out"],
    ["bake", "sample:flat", "--request", ""], ["bake", "sample:flat", "-o="], ["import", "sample:flat", "--channel="],
    ["import"], ["import", "a", "b"], ["render"], ["render", "-o", "--"], ["render", "-o=--"], ["assign", "--save=--"],
    ["paint\n"], [], ["import", "sample:flat", "--json", ""], ["render", "-o", "a.png", "--engine", "x" * 10**5],
])  # fmt: skip
def test_lines_that_nobody_means(addon, scene, capfd, argv):
    assert len(fault(capfd, addon, *argv)) < 600


@pytest.mark.parametrize("place", ["/dev/null/a", "/proc/none/a", "a" * 300])
def test_places_that_cannot_be_written(addon, scene, scan, baked, capfd, place):
    """A remedy is given, even if the error line is Blender's own."""
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    assert "; " in fault(capfd, addon, "import", "sample:flat", "--save", f"{place}.blend")
    assert "; " in fault(capfd, addon, "import", "sample:flat", "--json", f"{place}.json", "--save", "/dev/null/a")
    assert "; " in fault(capfd, addon, "assign", baked, "--object", "Plane", "--save", f"{place}.blend")
    assert "; " in fault(capfd, addon, "bake", "sample:flat", "-o", place, "--delta-e", "5", "--coherence-um", "2")


def test_the_cache_of_the_extension_is_listed_verified_and_pruned(addon, scene, baked, tmp_path, capfd, monkeypatch):
    """The files that scenes refer to, under `bakes` in the same folder, stay."""
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(tmp_path / "cache"))
    kept = tmp_path / "cache" / "bakes" / "scene" / "waves.exr"
    kept.parent.mkdir(parents=True)
    shutil.copy(baked, kept)
    cache = Cache(addon.cache_folder.cache_folder())
    assert cache.put("f" * 64, baked.parent, {"files": [baked.name]}, of={})
    assert addon.commands.execute(["cache", "list"]) == 0
    assert "ffffffffffff  waves  " in capfd.readouterr().out
    (tmp_path / "cache" / "entries" / ("f" * 64) / "files" / baked.name).write_bytes(b"cut")
    assert "1 of 1 bake is damaged" in fault(capfd, addon, "cache", "verify")
    assert addon.commands.execute(["cache", "prune", "--all"]) == 0
    assert list(cache.entries()) == [] and kept.read_bytes() == baked.read_bytes()


@pytest.mark.night("test_linked_duplicates_are_unwrapped_once")
def test_verbs_that_wait_report_their_progress(addon, scene, grating, tmp_path, capfd):
    """Each line is a stage and a percentage, and the last stage ends at 100 %."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, 0, 2)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.ops.grating.assign()
    saved = ["--save", str(tmp_path / "plane.blend")]
    for asked in (
        ["needs", "-o", str(tmp_path / "needs.json"), "--frames", "1", "3"],
        ["comb", "--object", "Plane", "--source", "axis", *saved],
        ["unwrap", "--object", "Plane", *saved],
    ):
        capfd.readouterr()
        assert addon.commands.execute(asked) == 0
        lines = [line for line in capfd.readouterr().err.splitlines() if re.fullmatch(r"[a-z ]+: +\d+%", line)]
        assert lines and lines[-1].endswith(": 100%")
