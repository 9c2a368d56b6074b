# SPDX-License-Identifier: GPL-3.0-or-later
"""`job`: a scene's pictures are all rendered, none twice, and each with its record."""

import importlib
import json

import bpy
import numpy as np
import pytest
from PIL import Image

from precompute.base.locks import try_lock

JOB = """
scene = "plane.blend"
output = "out"
[pictures]
zooms = [1, 2]
engines = ["cycles"]
samples = 1
width = 16
height = 16
[[grating]]
name = "waves"
scans = ["{scan}"]
size_um = 4
height_nm = 100
delta_e = 6
objects = ["Plane"]
lights = "lamps"
inputs = {{Roughness = 0.1}}
[[light]]
lamp = "Sun"
azimuth_deg = [0, 90]
elevation_deg = [60]
"""
NAMES = [f"waves_x{zoom}_Sun-a{azimuth}" for zoom in (1, 2) for azimuth in (0, 90)]


@pytest.fixture
def job(addon, scene, scan, tmp_path):
    """A job of four pictures of the plane under two suns, its file open in Blender."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, 0, 3)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "plane.blend"))
    path = tmp_path / "job.toml"
    path.write_text(JOB.format(scan=scan.as_posix()))
    yield path
    bpy.ops.wm.read_homefile(use_empty=True)


def events(folder) -> list[tuple[str, str]]:
    """The events and pictures of all logs, in their order."""
    lines = [line for path in sorted(folder.glob("logs/*.jsonl")) for line in path.read_text().splitlines()]
    return [(record["event"], record.get("picture")) for record in map(json.loads, lines)]


def test_all_pictures_are_rendered_once(addon, job, tmp_path, capfd):
    folder = tmp_path / "out" / "pictures"
    assert addon.commands.execute(["job", str(job)]) == 0
    assert sorted(path.stem for path in folder.glob("*.exr")) == sorted(NAMES)
    assert (tmp_path / "out" / "contact_sheet.png").is_file()
    assert "[####################] 4 of 4, 0 s left; waves_x2_Sun-a90" in capfd.readouterr().err
    first, other = (np.asarray(Image.open(folder / f"{name}.png")) for name in NAMES[:2])
    assert (first != other).any(), "the sun goes round"
    record = json.loads((folder / f"{NAMES[0]}.json").read_text())
    assert record["made_by"]["request"]["scans"][0]["size_um"] == 4
    assert record["picture"]["id"] in Image.open(folder / f"{NAMES[0]}.png").info["Note"]

    # Pictures that are damaged, at the same length, or whose record is no longer theirs are rendered again, alone. The
    # scene is not made again. What killed processes left is removed, and the artist's own hidden files stay.
    scene = (tmp_path / "out" / "scenes" / "waves.blend").stat().st_mtime_ns
    raw = (folder / f"{NAMES[2]}.exr").read_bytes()
    (folder / f"{NAMES[2]}.exr").write_bytes(raw[:-1] + bytes([raw[-1] ^ 1]))
    record_path = folder / f"{NAMES[0]}.json"
    record_path.write_text(json.dumps(json.loads(record_path.read_text()) | {"files": {}}))
    left = [folder / ".picture.0a1b2c3d.abcdefgh..partial", tmp_path / f"out/scenes/.grating.{'0a' * 8}.blend@"]
    left[0].mkdir()
    (left[0] / ".lock").touch()
    left[1].touch()
    kept = [tmp_path / "out" / "scenes" / ".grating.mine.blend", folder / ".picture.mine.partial"]
    for path in kept:
        path.touch()
    before = len(events(tmp_path / "out"))
    assert addon.commands.execute(["job", str(job)]) == 0
    later = events(tmp_path / "out")[before:]
    assert [name for event, name in later if event == "rendered"] == [NAMES[0], NAMES[2]]
    assert [name for event, name in later if event == "finished before"] == [NAMES[1], NAMES[3]]
    assert (tmp_path / "out" / "scenes" / "waves.blend").stat().st_mtime_ns == scene
    assert not any(path.exists() for path in left) and all(path.exists() for path in kept)


def test_a_cut_picture_is_no_picture(addon, job, tmp_path, monkeypatch, capfd):
    """A limit on the size of files stands for a full disk: Blender renders, writes a part and reports success."""
    resource = pytest.importorskip("resource", reason="this system has no limit of a file's size")
    one = job.read_text().replace("= 16", "= 96").replace("[1, 2]", "[1]").replace("[0, 90]", "[0]")
    job.write_text(one)
    assert addon.commands.execute(["job", str(job), "--step", "bake"]) == 0
    render, limits = addon.worker.render, resource.getrlimit(resource.RLIMIT_FSIZE)

    def on_a_full_disk(*arguments, **facts):
        resource.setrlimit(resource.RLIMIT_FSIZE, (6000, limits[1]))
        try:
            render(*arguments, **facts)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)

    with monkeypatch.context() as patch:
        patch.setattr(addon.worker, "render", on_a_full_disk)
        assert addon.commands.execute(["job", str(job), "--step", "frames"]) == addon.worker.FAILED
    assert not list((tmp_path / "out" / "pictures").iterdir())
    (log,) = [
        path.read_text() for path in (tmp_path / "out" / "logs").glob("*") if '"event": "failed"' in path.read_text()
    ]
    assert "waves.exr: cannot be written (Blender wrote only a part of it); check its folder" in log
    assert addon.commands.execute(["job", str(job), "--step", "frames"]) == 0
    assert len(list((tmp_path / "out" / "pictures").glob("*.exr"))) == 1


def test_a_task_removes_what_a_killed_task_left(addon, job, tmp_path):
    """On its own machine, and not the folder of a task that lives. The third was killed while it removed its folder."""
    assert addon.commands.execute(["job", str(job), "--step", "bake"]) == 0
    folder, name = tmp_path / "out" / "pictures", addon.worker.machine_name()
    left = [folder / f".picture.{name}.abcdefg{number}..partial" for number in (1, 2, 3)]
    for each in left:
        each.mkdir(parents=True)
    for each in left[:2]:
        (each / ".lock").touch()
    with try_lock(left[0] / ".lock"):
        assert addon.worker.main([str(tmp_path / "out" / "scenes" / "waves.json"), "--task", "1"]) == 0
    assert [each.exists() for each in left] == [True, False, False]


def test_without_pillow_a_job_leaves_out_its_contact_sheet(addon, job, tmp_path, monkeypatch, capfd):
    """The pictures are rendered all the same. The step alone is an error."""

    verb = importlib.import_module(f"{addon.package.__name__.rpartition('.')[0]}.precompute.cli.job_verb")

    def missing(*_):
        raise verb.GratingError("Pillow", "it is not installed for Python 3.14", "install it")

    monkeypatch.setattr(verb, "write_sheet", missing)
    assert addon.commands.execute(["job", str(job)]) == 0
    assert "no contact sheet: Pillow: it is not installed for Python 3.14; install it" in capfd.readouterr().err
    assert len(list((tmp_path / "out" / "pictures").glob("*.png"))) == 4
    assert addon.commands.execute(["job", str(job), "--step", "sheet"]) == 1


def test_a_changed_job_renders_what_changed(addon, job, tmp_path):
    assert addon.commands.execute(["job", str(job), "--step", "bake"]) == 0
    assert addon.commands.execute(["job", str(job), "--step", "frames"]) == 0
    job.write_text(job.read_text().replace("[0, 90]", "[0, 45]"))
    before = len(events(tmp_path / "out"))
    assert addon.commands.execute(["job", str(job)]) == 0
    rendered = [name for event, name in events(tmp_path / "out")[before:] if event == "rendered"]
    assert rendered == ["waves_x1_Sun-a45", "waves_x2_Sun-a45"]


@pytest.mark.night("test_a_task_removes_what_a_killed_task_left")
def test_a_picture_that_fails_is_tried_once_again(addon, job, tmp_path, monkeypatch, capfd):
    """The first fails once, the second twice. The others are rendered, and the exit status says that some failed."""
    render, failures = addon.worker.render, {NAMES[0]: 1, NAMES[1]: 2}

    def fail(picture, *others, **facts):
        if failures.get(picture["name"], 0) > 0:
            failures[picture["name"]] -= 1
            raise RuntimeError("Error: out of\nmemory")
        render(picture, *others, **facts)

    monkeypatch.setattr(addon.worker, "render", fail)
    assert addon.commands.execute(["job", str(job)]) == addon.worker.FAILED
    found = [event for event in events(tmp_path / "out") if event[1]]
    assert found[:4] == [("failed", NAMES[0]), ("rendered", NAMES[0]), ("failed", NAMES[1]), ("failed", NAMES[1])]
    assert f"failed twice: {NAMES[1]}; the log in" in capfd.readouterr().err
    assert sorted(path.stem for path in (tmp_path / "out" / "pictures").glob("*.png")) == sorted(
        set(NAMES) - {NAMES[1]}
    )


@pytest.mark.night("test_a_task_removes_what_a_killed_task_left")
def test_a_task_renders_its_part(addon, job, tmp_path):
    assert addon.commands.execute(["job", str(job), "--step", "bake", "--only", "waves"]) == 0
    part = ["--step", "frames", "--only", "waves", "--task", "2", "--per-task", "3"]
    assert addon.commands.execute(["job", str(job), *part]) == 0
    assert [path.stem for path in (tmp_path / "out" / "pictures").glob("*.exr")] == [NAMES[3]]


def test_a_bake_for_what_the_pictures_show(addon, job, tmp_path, monkeypatch):
    """Its needs are those of both zooms and both suns, and it is smaller than the whole bake."""
    monkeypatch.setattr(addon.baking, "_RAYS_LEAST", 500)
    job.write_text(job.read_text().replace('output = "out"', 'output = "out"\nneeds = true'))
    assert addon.commands.execute(["job", str(job), "--step", "needs"]) == 0
    record = json.loads((tmp_path / "out" / "needs" / "waves.json").read_text())
    (low_u, high_u), (low_v, high_v) = record["needs"]["u"], record["needs"]["v"]
    # Light at 60 degrees above the horizon from +X and +Y has u or v of .5, and the plane is seen nearly from above.
    assert high_u > 0.5 and high_v > 0.5 and low_u > -0.8 and low_v > -0.8
    assert addon.commands.execute(["job", str(job)]) == 0
    assert len(list((tmp_path / "out" / "pictures").glob("*.exr"))) == 4
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out" / "scenes" / "waves.blend"))
    assert bpy.context.scene.natural_gratings.items[-1].for_scene


@pytest.mark.parametrize(("before", "after", "told"), [
    ('lamp = "Sun"', 'lamp = "Moon"', "Moon: no such lamp in the scene; there are Sun"),
    ('objects = ["Plane"]', 'objects = ["Plan"]', "Plan: no such object in the scene"),
    ("zooms = [1, 2]", 'cameras = ["Sun"]', "Sun: no such camera in the scene; there are Camera"),
    ("plane.blend", "other.blend", "other.blend: cannot be read (No such file or directory)"),
    ("Roughness", "Rough", "no such input"),
])  # fmt: skip
def test_faults_are_told_before_anything_is_rendered(addon, job, tmp_path, capfd, before, after, told):
    job.write_text(job.read_text().replace(before, after))
    capfd.readouterr()
    assert addon.commands.execute(["job", str(job)]) == 1
    (line,) = [line for line in capfd.readouterr().err.splitlines() if line.startswith("error:")]
    assert told in line
    assert not (tmp_path / "out" / "pictures").exists() and not list((tmp_path / "out").glob("scenes/*.json"))


def test_a_plan_of_another_version_is_refused(addon, job, tmp_path, capfd):
    """And a file in the place of the pictures is the one that is blamed, not the log."""
    assert addon.commands.execute(["job", str(job), "--step", "bake"]) == 0
    (tmp_path / "out" / "pictures").touch()
    assert addon.commands.execute(["job", str(job), "--step", "frames"]) == 1
    assert f"error: {tmp_path / 'out' / 'pictures'}: cannot be written (File exists)" in capfd.readouterr().err
    plan = tmp_path / "out" / "scenes" / "waves.json"
    assert addon.worker.read_plan(plan)["pictures"][0]["name"] == NAMES[0]
    plan.write_text(plan.read_text().replace('"format": 1', '"format": 0'))
    assert addon.worker.main([str(plan)]) == 1
    told = "(format: another version of the extension made it); run the job's earlier steps again"
    assert told in capfd.readouterr().err


@pytest.mark.parametrize("words", [
    [], ["a", "b"], ["a", "--task"], ["a", "--task", "x"], ["a", "--task", "-1"], ["a", "--threads", "1025"],
    ["a", "--frames", "1"], ["a", "--task", "１"], ["a", "--per-task", "9" * 400],
])  # fmt: skip
def test_a_worker_refuses_other_words_in_one_line(addon, capfd, words):
    assert addon.worker.main(words) == 1
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("error: ") and len(line) < 200


def test_an_animated_lamp_is_refused(addon, job, tmp_path, capfd):
    lamp = bpy.data.objects["Sun"]
    lamp.keyframe_insert("rotation_euler", frame=1)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "plane.blend"))
    assert addon.commands.execute(["job", str(job)]) == 1
    assert "Sun: it is animated or constrained; remove that, or leave it out of the job" in capfd.readouterr().err


def test_one_job_is_not_rendered_twice_at_once(addon, job, tmp_path, capfd):
    (tmp_path / "out").mkdir()
    with try_lock(tmp_path / "out" / ".job.lock"):
        assert addon.commands.execute(["job", str(job)]) == 1
    assert "another process renders this job; wait for it" in capfd.readouterr().err


def test_a_lamp_goes_round_an_object_at_its_distance(addon, job):
    """Above the middle of the plane at 90 degrees, and at its horizon at 0; it shines at the plane."""
    lamp = bpy.data.objects["Sun"]
    lamp.data.type, lamp.location = "POINT", (3, 0, 4)
    bpy.context.view_layer.update()
    setup = addon.picture_setup
    base = setup.Base.now()
    picture = {"frame": None, "camera": None, "zoom": None, "engine": None, "seed": None, "samples": None}
    picture |= {"denoise": None, "width": None, "height": None}
    for azimuth, elevation, place in ((0, 90, (0, 0, 5)), (90, 0, (0, 5, 0)), (180, 0, (-5, 0, 0))):
        angles = {"azimuth_deg": azimuth, "elevation_deg": elevation}
        state = {"lamp": "Sun", "strength": 2.0, "around": "Plane", **angles}
        setup.set_up(picture | {"lamps": [state]}, base)
        # Single precision holds lengths of 5 to 5e-7.
        assert tuple(lamp.matrix_world.translation) == pytest.approx(place, abs=1e-5)
        assert tuple(lamp.matrix_world.col[2].xyz.normalized()) == pytest.approx(np.array(place) / 5, abs=1e-6)
        assert lamp.data.energy == 2.0
    setup.set_up(picture | {"lamps": []}, base)
    with pytest.raises(setup.GratingError, match="`around` is missing; name the object"):
        setup.set_up(picture | {"lamps": [state | {"around": None}]}, base)


def test_frames_of_the_open_file_and_resume(addon, job, tmp_path, capfd):
    """`render --frames` numbers its pictures, and --resume leaves those that are there."""
    options = ["--engine", "cycles", "--samples", "1", "--width", "8", "--height", "8"]
    command = ["render", "-o", str(tmp_path / "turn.png"), "--frames", "1-5:2", *options]
    assert addon.commands.execute(command) == 0
    names = [f"turn_000{frame}.png" for frame in (1, 3, 5)]
    assert sorted(path.name for path in tmp_path.glob("turn*")) == names
    (tmp_path / names[1]).unlink()
    kept = (tmp_path / names[0]).stat().st_mtime_ns
    assert addon.commands.execute([*command, "--resume"]) == 0
    assert "1 rendered, 2 there already" in capfd.readouterr().out
    assert (tmp_path / names[1]).is_file() and (tmp_path / names[0]).stat().st_mtime_ns == kept
    assert addon.commands.execute(["render", "-o", str(tmp_path / "b##.png"), "--frames", "7", *options]) == 0
    assert (tmp_path / "b07.png").is_file()
