# SPDX-License-Identifier: GPL-3.0-or-later
"""The zip, installed into an empty user folder of each available Blender."""

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.hostile_folder import set_traps

HERE = Path(__file__).parent
SMALL_CYCLES = """
import bpy
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.samples = 1
scene.render.resolution_x = scene.render.resolution_y = 64
"""


def pixels(picture: Path) -> np.ndarray:
    """(rows, cols, 3) as displayed, 0 to 1."""
    return np.asarray(Image.open(picture).convert("RGB")) / 255


def saturation(picture: np.ndarray) -> np.ndarray:
    """(rows, cols): 0 grey, 1 pure."""
    brightest = picture.max(axis=-1)
    return (brightest - picture.min(axis=-1)) / np.maximum(brightest, 1e-9)


def test_add_on_and_packages_are_those_of_the_zip(blender):
    blender.run_script(HERE / "check_installed.py")


def test_commands_of_the_installed_extension_answer(blender):
    assert "grating" in blender.run("--background", "--command", "help")


@pytest.mark.short("bpy-5.3")
def test_installed_extension_runs_nothing_of_the_working_folder(blender, tmp_path):
    """Neither Blender nor the baking process runs it."""
    (tmp_path / "folder").mkdir()
    mark = set_traps(tmp_path / "folder")
    there = replace(blender, started_in=tmp_path / "folder")
    quick = ("--delta-e", "6", "--coherence-um", "4", "--illuminant", "532nm")
    there.run_grating("bake", "sample:blazed", *quick, "-o", tmp_path / "bake", "--no-cache")
    assert (tmp_path / "bake" / "blazed.exr").is_file()
    assert not mark.exists()


@pytest.mark.parametrize(
    "blender, lights",
    [("bpy-4.5", "lamps"), ("bpy-4.5", "rest"), ("bpy-5.3", "rest"), ("binary", "all")],
    indirect=["blender"],
)
@pytest.mark.short("5.3-rest", "binary-all")
def test_installed_extension_bakes_assigns_and_renders(blender, tmp_path, lights):
    """The file also renders the same in an empty user folder, without the extension and with auto-run off: with lamps
    alone, and by closures with a sky and its sun."""
    scene, bake = tmp_path / "plane.blend", tmp_path / "bake"
    blender.run_script(HERE / "make_plane.py", scene, *([] if lights == "lamps" else ["sky"]))
    blender.run_grating("bake", "sample:blazed", "--delta-e", "6", "--coherence-um", "4", "-o", bake)
    blender.run_grating("assign", bake, "--object", "Plane", "--lights", lights, scene=scene)
    noted = f"assert ('ng_world_0_power' in bpy.context.scene) == {lights == 'rest'}, 'sources of the world'"
    blender.run("--background", scene, "--python-exit-code", "1", "--python-expr", f"import bpy; {noted}")
    size = ("--engine", "cycles", "--samples", "1", "--width", "64", "--height", "64")
    blender.run_grating("render", *size, "-o", tmp_path / "with.png", scene=scene)
    picture = pixels(tmp_path / "with.png")
    # Without the spectra the plane has the sky's colour, whose saturation is below 0.33 in 95 % of the pixels. Of
    # 1024 pixels of one random sample it may happen that none meets the sun.
    assert saturation(picture).max() > 0.4, "no colour: the sun's spectra should cross the plane"

    bare = replace(blender, user_folder=tmp_path / "empty")
    shot = ("--python-expr", SMALL_CYCLES, "-o", tmp_path / "without_", "-F", "PNG", "-f", "1")
    bare.run("--background", "-Y", scene, *shot)
    assert not list(bare.user_folder.glob("extensions/user_default/*"))
    # Same sampler, one sample, 8 bits: equal to the last step.
    assert np.array_equal(pixels(tmp_path / "without_0001.png"), picture)


def test_the_installed_extension_keeps_the_files_of_its_zip(blender, built):
    """After the tests above: Blender's Python adds only byte code."""
    (folder,) = blender.user_folder.glob("extensions/user_default/natural_gratings")
    found = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    with zipfile.ZipFile(built["linux_x64"]) as package:
        held = {name: package.read(name) for name in package.namelist() if not name.endswith("/")}
    found = {name: path.read_bytes() for name, path in found.items() if "__pycache__" not in name}
    assert set(found) == set(held)
    assert [name for name, data in held.items() if found[name] != data] == []
