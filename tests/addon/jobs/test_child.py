# SPDX-License-Identifier: GPL-3.0-or-later
"""The child process beside Blender: what it imports, and how it ends by Esc, by a kill, and with Blender."""

import math
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import bpy
import pytest

from devtools import EXTENSION, ROOT
from tests.hostile_folder import set_traps

# Starts a bake as Blender does, prints the process's number and the private folder, and ends as its last line says.
STARTER = """
import importlib, os, sys, time
from pathlib import Path
from devtools import EXTENSION
import bpy
import addon_utils
assert addon_utils.enable(EXTENSION) is not None
child = importlib.import_module(f"{{EXTENSION}}.addon.jobs.child")
deadline = child.Deadline(600, child.GratingError("", "", ""))
job = child.Job("bake", ["sample:elaphe", "--no-cache"], Path(sys.argv[1]), deadline=deadline)
while job.progress()[0] == "starting":
    time.sleep(0.05)
keeper = job._process.pid
process = Path(f"/proc/{{keeper}}/task/{{keeper}}/children").read_text().split()[0]
print(process, job._private.name, flush=True)
{end}
"""
ENDS = {"killed": "os.kill(os.getpid(), 9)", "crashed": "os._exit(3)", "closed": "sys.exit(0)"}


@pytest.fixture
def job(addon, scene, tmp_path):
    """A bake that is running and takes a while."""
    bpy.ops.grating.import_height_map(filepath="sample:elaphe")
    started = addon.baking.start_bake(scene.natural_gratings.active(), str(tmp_path / "out"), use_cache=False)
    deadline = time.monotonic() + 60
    while started.progress()[0] == "starting":
        assert started.running and time.monotonic() < deadline
        time.sleep(0.05)
    yield started
    if started.running:
        started.cancel()


def is_alive(process: int) -> bool:
    """Whether a process runs. A zombie does not."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.night("test_a_killed_process_is_told_in_words")
@pytest.mark.parametrize("python_path", [None, "", os.pathsep])
def test_nothing_of_the_working_folder_is_run(addon, scene, scan, tmp_path, monkeypatch, python_path):
    """The working folder is that of the .blend, or the one where Blender was started."""
    (tmp_path / "folder").mkdir()
    mark = set_traps(tmp_path / "folder")
    monkeypatch.chdir(tmp_path / "folder")
    monkeypatch.delenv("PYTHONPATH", raising=False)
    if python_path is not None:
        monkeypatch.setenv("PYTHONPATH", python_path)
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    facts = addon.baking.bake_and_wait(scene.natural_gratings.active(), str(tmp_path / "out"))
    assert Path(facts["files"][0]).is_file()
    assert not mark.exists()


def test_settings_of_other_pythons_are_left_out(addon, monkeypatch):
    for name in ("PYTHONHOME", "PYTHONSTARTUP", "PYTHONUSERBASE", "PYTHONINSPECT", "PYTHONWARNINGS"):
        monkeypatch.setenv(name, "/nowhere")
    found = addon.child.child_environment()
    assert {name for name in found if name.startswith("PYTHON")} == {"PYTHONPATH", "PYTHONIOENCODING"}
    assert all(found["PYTHONPATH"].split(os.pathsep))


def test_cancelling_leaves_nothing(job, tmp_path):
    private = Path(job._private.name)
    job.cancel()
    assert not job.running and not private.exists()
    assert list(tmp_path.iterdir()) == []


def test_cancelling_removes_what_a_killed_process_left(job, tmp_path):
    """Other jobs' files stay, for example those of a second bake into the same folder."""
    other = tmp_path / "out" / ".bake.0123.abcdefgh..partial"
    other.mkdir(parents=True)
    name = Path(job._private.name).name
    left = tmp_path / "out" / f".grating.abcdefgh.{name}.partial"
    left.mkdir()
    (left / "half.exr").write_bytes(b"half")
    job._process.kill()
    job._process.wait()
    job.cancel()
    assert list((tmp_path / "out").iterdir()) == [other]


def test_an_interrupted_wait_stops_the_process(job, tmp_path, monkeypatch):
    """As by Ctrl-C while Blender runs a command."""
    wait = job._process.wait

    def interrupted(*_):
        monkeypatch.setattr(job._process, "wait", wait)
        raise KeyboardInterrupt

    monkeypatch.setattr(job._process, "wait", interrupted)
    with pytest.raises(KeyboardInterrupt):
        job.wait()
    assert not job.running
    assert list(tmp_path.iterdir()) == []


def test_a_job_that_hangs_is_ended_at_its_deadline(addon, scene, tmp_path):
    """In one line that names its file; nothing is left behind."""
    deadline = addon.child.Deadline(0.5, addon.child.GratingError("elaphe.png", "not baked within 0.5 s", "crop it"))
    job = addon.child.Job("bake", ["sample:elaphe", "--no-cache"], tmp_path / "out", deadline=deadline)
    private = Path(job._private.name)
    job.wait()
    with pytest.raises(addon.child.GratingError, match="^elaphe.png: not baked within 0.5 s; crop it$"):
        job.result()
    assert not private.exists() and list(tmp_path.iterdir()) == []


def test_a_failure_comes_with_its_fields(addon, scan, tmp_path):
    deadline = addon.child.Deadline(60, addon.child.GratingError("", "", ""))
    job = addon.child.Job("bake", [str(scan)], tmp_path / "out", deadline=deadline)
    job.wait()
    assert job.progress()[0] != "error"
    with pytest.raises(addon.child.GratingError) as failure:
        job.result()
    error, setting = failure.value, addon.wording.Setting
    assert (error.what, error.fault) == (str(scan), "a picture stores no width")
    assert error.remedy == ("give ", setting.SIZE_UM, ", the width of the scan in micrometres")


@pytest.mark.night("test_a_failure_comes_with_its_fields")
@pytest.mark.parametrize(("printed", "told"), [
    ("", r"^bake: its process ended without a message \(status 1\); try again$"),
    ('{"error": {"what": "a.p', r"^bake: its process ended without a message \(status 1\); try again$"),
    ('Traceback\nImportError: no NumPy\n{"error": {"wh', "^bake: ImportError: no NumPy; try again$"),
    ('{"error": {"what": "a", "fault": "b", "remedy": ["take ", {"setting": "--new"}]}}\n{"stage": "x"',
     "^a: b; take --new$"),
])  # fmt: skip
def test_a_process_may_die_at_half_a_line(addon, scan, tmp_path, printed, told):
    deadline = addon.child.Deadline(60, addon.child.GratingError("", "", ""))
    job = addon.child.Job("bake", [str(scan)], tmp_path / "out", deadline=deadline)
    job.wait()
    job.err_path.write_text(printed)
    assert job.progress() == ("starting", 0.0)
    with pytest.raises(addon.child.GratingError, match=told) as failure:
        job.result()
    assert addon.wording.in_words(failure.value) == str(failure.value)


def test_every_job_has_a_deadline(addon, scene, monkeypatch):
    """A bake has a day for each of its scans. Jobs on meshes have minutes."""
    ended = []

    class Started(Exception):
        pass

    def start(self, prepare, environment, *, longest_seconds=math.inf):
        ended.append(longest_seconds)
        raise Started

    monkeypatch.setattr(addon.child.ChildProcess, "__init__", start)
    mesh = bpy.context.object
    bpy.ops.grating.import_height_map(filepath="sample:elaphe")
    grating = scene.natural_gratings.active()
    request = grating.bake_request()
    works = {
        "bake": (lambda: addon.baking.start_bake(grating), 24 * 3600),
        "bake of two": (
            lambda: addon.baking.start_bake(grating, request=replace(request, scans=2 * request.scans)), 48 * 3600,
        ),
        "images": (lambda: addon.making_osl_references.write_images(grating, "flss"), 24 * 3600),
        "comb": (lambda: addon.combing.start_comb(scene, [mesh], "X"), 600),
        "unwrap": (lambda: addon.unwrapping.Unwrapping(mesh, addon.unwrapping.Packing()), 640),
    }  # fmt: skip
    for name, (work, seconds) in works.items():
        with pytest.raises(Started):
            work()
        assert ended.pop() == pytest.approx(seconds, rel=0.01), name


def test_a_killed_process_is_told_in_words(addon, job):
    keeper = job._process.pid
    (process,) = Path(f"/proc/{keeper}/task/{keeper}/children").read_text().split()
    os.kill(int(process), signal.SIGKILL)
    job.wait()
    with pytest.raises(addon.child.GratingError, match=r"bake: .* ended without a message \(status 137\); "):
        job.result()


@pytest.mark.night("tests/precompute/cli/test_stopped.py")
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks Linux for the process")
@pytest.mark.parametrize("end", ENDS)
def test_the_process_ends_with_blender(extension, tmp_path, end):
    code = STARTER.format(end=ENDS[end])
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "out")], cwd=ROOT, stdout=subprocess.PIPE, text=True, timeout=120
    )
    process, private = done.stdout.splitlines()[-1].split()
    deadline = time.monotonic() + 60
    while is_alive(int(process)) or Path(private).exists():
        assert time.monotonic() < deadline
        time.sleep(0.1)
    assert list(tmp_path.iterdir()) == []


def test_disabling_the_extension_stops_its_bake(addon, job):
    operator = sys.modules[f"{EXTENSION}.addon.operators.bake"].BakeGrating
    operator.job = job
    sys.modules[f"{EXTENSION}.addon.operators.bake"].BakeGrating.stop()
    assert operator.job is None and not job.running
