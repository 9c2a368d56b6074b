# SPDX-License-Identifier: GPL-3.0-or-later
"""A job on a farm: the installed zip bakes, workers without the extension render, and the pixels are those of one
process alone."""

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from devtools.steps import clean_environment

HERE = Path(__file__).parent
JOB = """
scene = "plane.blend"
[pictures]
engines = ["cycles", "eevee"]
samples = 2
width = 32
height = 32
[[grating]]
scans = ["sample:blazed"]
delta_e = 6
coherence_um = 4
illuminant = "532nm"
objects = ["Plane"]
lights = "lamps"
"""
COUNT = 2


@pytest.fixture(scope="module")
def folder(blender, tmp_path_factory) -> Path:
    """A folder with the plane's file and the job."""
    folder = tmp_path_factory.mktemp("farm")
    blender.run_script(HERE / "make_plane.py", folder / "plane.blend")
    (folder / "job.toml").write_text(JOB)
    return folder


@pytest.fixture(scope="module")
def alone(blender, folder) -> Path:
    """The job's output by one process, which was killed once at its first picture and started again."""
    output = folder / "alone"
    words = ("--background", "--command", "grating", "job", folder / "job.toml", "-o", output, "--threads", "1")
    variables = clean_environment(BLENDER_USER_RESOURCES=str(blender.user_folder))
    variables["NATURAL_GRATINGS_CACHE"] = str(blender.user_folder / "cache")
    line = [*blender.command, *map(str, words)]
    # A group of its own, because a Blender in a chroot is a child of the command.
    with subprocess.Popen(
        line, env=variables, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    ) as process:
        while process.poll() is None and not list(output.glob("pictures/*.json")):
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGKILL)
    blender.run(*words)
    return output


def command(blender, path: Path) -> Path:
    """A program that runs a Blender in its user folder: a template's command is one word."""
    variables = {
        "BLENDER_USER_RESOURCES": blender.user_folder, "NATURAL_GRATINGS_CACHE": blender.user_folder / "cache"
    }  # fmt: skip
    lines = [f"export {name}={shlex.quote(str(value))}" for name, value in variables.items()]
    path.write_text("\n".join(["#!/bin/sh", *lines, f'exec {shlex.join(blender.command)} "$@"', ""]))
    path.chmod(0o755)
    return path


def openjd(*words: object, **options) -> subprocess.Popen:
    """A run of the command line of Open Job Description."""
    line = [str(Path(sys.executable).with_name("openjd")), *map(str, words)]
    return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)


def done(process: subprocess.Popen) -> str:
    """The output of a run; the test fails with it if its status is not 0."""
    output, _ = process.communicate(timeout=600)
    assert process.returncode == 0, output
    return output


@pytest.mark.short("bpy-5.3")
def test_no_picture_is_rendered_twice(alone):
    """Killed and started again. The kill may come after a picture's record and before its line in the log."""
    lines = [line for log in alone.glob("logs/*.jsonl") for line in log.read_text().splitlines()]
    rendered = [record["picture"] for record in map(json.loads, lines) if record["event"] == "rendered"]
    assert len(rendered) == len(set(rendered)) and COUNT - 1 <= len(rendered) <= COUNT
    assert len(list(alone.glob("pictures/*.exr"))) == len(list(alone.glob("pictures/*.png"))) == COUNT
    assert not list(alone.glob("pictures/.*")), "nothing is left of the killed process"


@pytest.mark.night("test_no_picture_is_rendered_twice")
def test_sessions_of_workers_without_the_extension_render_the_same(blender, folder, alone, tmp_path):
    pytest.importorskip("openjd.cli", reason="openjd-cli is in one environment")
    output, bundle = tmp_path / "out", tmp_path / "bundle"
    with_it = command(blender, tmp_path / "with")
    bare = replace(blender, user_folder=tmp_path / "empty")
    without = command(bare, tmp_path / "without")
    blender.run_grating("job", folder / "job.toml", "-o", output, "--bundle", bundle, "--bundle-per-task", "1")
    template = bundle / "template.json"
    done(openjd("check", template))
    values = [
        "-p", f"JobFile={folder / 'job.toml'}", "-p", f"OutputDir={output}", "-p", f"ScriptsDir={bundle / 'scripts'}",
        "-p", "Threads=1",
    ]  # fmt: skip
    done(openjd("run", template, *values, "-p", f"Blender={with_it}", "--step", "Bake"))
    # Two sessions at once, each with every second picture.
    sessions = [
        openjd(
            "run", template, *values, "-p", f"Blender={without}", "--step", "Frames",
            "--tasks", json.dumps([{"Grating": "blazed", "Part": part}]),
        )
        for part in (1, 2)
    ]  # fmt: skip
    told = [done(session) for session in sessions]
    assert all("openjd_progress: 100.0" in one for one in told)
    assert not list(bare.user_folder.glob("extensions/user_default/*"))
    told, _ = openjd("run", template, *values, "-p", f"Blender={with_it}", "--step", "ContactSheet").communicate()
    # The Blender of a distribution may lack Pillow.
    assert (output / "contact_sheet.png").is_file() != ("error: Pillow: it is not installed" in told), told

    pictures = sorted(path.stem for path in (output / "pictures").glob("*.exr"))
    assert len(pictures) == COUNT
    for name in pictures:
        both = [place / "pictures" for place in (alone, output)]
        assert np.array_equal(*(exr_pixels(place / f"{name}.exr") for place in both)), name
        assert np.array_equal(*(np.asarray(Image.open(place / f"{name}.png")) for place in both)), name


def exr_pixels(path: Path) -> np.ndarray:
    """(rows, cols, channels)"""
    with OpenEXR.File(str(path)) as file:
        (channel,) = file.channels().values()
        return channel.pixels.copy()
