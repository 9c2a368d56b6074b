# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands of the pages as they are printed: each in a process of its own, page by page, from top to bottom."""

import json
import re
import shutil
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from devtools import ROOT
from tests.precompute.surface.scan_files import nid_bytes
from tests.printed_commands import PAGES, on_lines

from .conftest import chosen_binary

# The mesh in each file that the commands open.
NAMES = {"snake": "Snake", "card": "Card", "can": "Can", "wall": "Carrier", "disc": "Disc", "shot": "Snake"}
SIDE, SCAN_M = 96, 48e-6
TURNTABLE = """
output = "turntable"
[pictures]
engines = ["cycles"]
samples = 1
width = 16
height = 16
[[grating]]
scans = ["scan.nid"]
delta_e = 6
objects = ["Snake"]
"""
# A real Blender where there is one, else a wheel.
BLENDER = "binary" if chosen_binary() else "bpy-5.3"
# Programs and verbs that other tests run, that take hours, or that are not ours.
_ELSEWHERE = {"bench", "demo", "test", "benchmark", "extension", "asset_listing"}


def commands(page: Path) -> list[list[str]]:
    """The commands of a page that are run here."""
    return [words for words in on_lines(page) if words[0] != "python" and not _ELSEWHERE & set(words)]


@pytest.fixture
def folder(tmp_path) -> Path:
    """A folder with the files that the commands read."""
    # Rough, because one window of a perfect grating has orders too narrow for a patch bake's limit. No deeper than that
    # limit needs, because a bake takes time in proportion to its functions of w.
    bumps = np.fft.fft2(np.random.default_rng(1).standard_normal((SIDE, SIDE)))
    per_pixel = np.hypot(np.fft.fftfreq(SIDE), np.fft.fftfreq(SIDE)[:, None])
    heights = np.fft.ifft2(bumps * np.exp(-((per_pixel / 0.12) ** 2))).real
    heights *= 30e-9 / heights.std()
    for name in ("scan.nid", "one.nid", "other.nid"):
        (tmp_path / name).write_bytes(nid_bytes(heights, pixel_m=SCAN_M / SIDE))
    grey = np.interp(heights, [heights.min(), heights.max()], [0, 65535])
    for name in ("scan.png", "logo.png"):
        Image.fromarray(np.rint(grey).astype(np.uint16)).save(tmp_path / name)
    (tmp_path / "lamp.csv").write_text("400, 1\n700, 1\n")
    points = np.eye(3)
    np.savez(tmp_path / "mesh.npz", points=points, triangles=[[0, 1, 2]], polygons=[0])
    needs = re.search(r"^    (\{.*?\})$", text_of("scans"), re.MULTILINE | re.DOTALL)[1]
    (tmp_path / "needs.json").write_text(json.dumps(json.loads(needs)))
    lines = re.search(r"^    output = .*?(?=^\S)", text_of("jobs"), re.MULTILINE | re.DOTALL)[0]
    job = re.sub(r"^    ", "", lines, flags=re.MULTILINE)
    # A picture of each preset instead of 24.
    for key, value in {"engines": ["cycles"], "zooms": [1], "azimuth_deg": [50]}.items():
        job = re.sub(rf"^{key} = .*", f"{key} = {json.dumps(value)}", job, flags=re.MULTILINE)
    (tmp_path / "thumbnails.toml").write_text(job)
    (tmp_path / "turntable.toml").write_text(TURNTABLE)
    return tmp_path


def text_of(name: str) -> str:
    return (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")


@pytest.mark.night("tests/addon/batch/test_commands.py")
@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=lambda page: page.stem)
@pytest.mark.parametrize("blender", [BLENDER], indirect=True)
def test_every_command_runs(blender, folder, page):
    """Each mesh wears a bake of skin.exr, and `belly.exr` is another. What they write under /share is in the folder."""
    (folder / "share").mkdir()
    used = " ".join(chain(*commands(page)))
    files = {folder / f"{file}.blend": thing for file, thing in NAMES.items() if f"{file}.blend" in used}
    if files:
        blender.run_script(Path(__file__).with_name("make_printed_scenes.py"), *chain(*files.items()))
        for name in ("belly", "skin"):
            shutil.copy(folder / "scan.nid", folder / f"{name}.nid")
            blender.run_grating("bake", folder / f"{name}.nid", "--delta-e", "6", "-o", folder)
    for file in files:
        blender.run_grating("bake", folder / "skin.nid", "--delta-e", "6", "-o", folder, scene=file)
        blender.run_grating("assign", folder / "skin.exr", "--object", files[file], scene=file)
    programs = {"blender": blender.command, "./dev": (str(ROOT / "dev"),)}
    failed = []
    for name, *words in commands(page):
        program = replace(blender, command=programs[name], started_in=folder)
        answer = program.start(*(re.sub(r"(^|=)/share", rf"\1{folder}/share", word) for word in words))
        if "unwrap" in words and "error: xatlas: it is not installed for Python" in answer.stderr:
            continue  # the Python of a distribution may be newer than the wheels
        if answer.returncode != 0 or "Traceback" in answer.stderr:
            failed.append(f"{name} {' '.join(words)}: {answer.returncode}\n{answer.stderr[-2000:]}")
    assert failed == []
