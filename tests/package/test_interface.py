# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons pressed with the mouse in a Blender with a window; the saved file renders the same without the extension."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from devtools import ROOT
from devtools.window import display as screen
from devtools.window import walk

from .conftest import Blender, binary_command

HERE = Path(__file__).parent
FRAME = "6"


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    """A separate virtual screen, high enough for all buttons of the panel."""
    if shutil.which("Xvfb") is None:
        pytest.skip("no Xvfb: on Debian the package xvfb brings it")
    with screen.display(height=1800) as name:
        yield name


@pytest.fixture(scope="module")
def blender(install) -> Blender:
    """A Blender binary with the extension installed from its zip into an empty user folder."""
    return install("binary")


def render(blender: Blender, file: Path, scene: str, frame: str, to: Path, *options: str) -> np.ndarray:
    """Render linear colours (rows, cols, 3) with Blender's own command line, not with the extension's command."""
    blender.run("--background", *options, file, "-S", scene, "-o", f"{to}_#", "-F", "OPEN_EXR", "-f", frame)
    with OpenEXR.File(f"{to}_{frame}.exr", separate_channels=True) as picture:
        return np.stack([picture.channels()[c].pixels for c in "RGB"], axis=-1)


def test_pressed_saved_and_reopened_without_the_extension(display, blender, tmp_path):
    file, bake = tmp_path / "unseen.blend", tmp_path / "bake"
    bare = replace(blender, user_folder=tmp_path / "empty")
    bare.run_script(HERE / "make_unseen.py", file)
    dull = render(bare, file, "Still", FRAME, tmp_path / "dull")
    blender.run_grating("bake", "sample:blazed", "--delta-e", "6", "-o", bake)

    window = replace(blender, command=("env", f"DISPLAY={display}", *blender.command))
    options = ("--enable-event-simulate", "--window-geometry", "0", "0", "1280", "1800")
    window.run(*options, file, "--python", HERE / "press_buttons.py", "--", bake / "blazed.exr")

    for scene, frame in (("Still", "1"), ("Still", FRAME), ("Other", "1")):
        here = render(blender, file, scene, frame, tmp_path / f"with_{scene}")
        there = render(bare, file, scene, frame, tmp_path / f"without_{scene}", "-Y", "--factory-startup")
        assert not list(bare.user_folder.glob("extensions/user_default/*"))
        # Same program and sampler at one sample, on one or two threads: equal to single precision.
        np.testing.assert_allclose(there, here, rtol=1e-6, atol=1e-6)
        if frame == FRAME:
            assert np.abs(here - dull).max() > 0.1, "no diffraction in the picture"


@pytest.mark.night("test_pressed_saved_and_reopened_without_the_extension")
def test_the_artists_walk(blender, tmp_path):
    """Each station asserts what it shows and leaves a picture that is not empty."""
    if shutil.which("Xvfb") is None:
        pytest.skip("no Xvfb: on Debian the package xvfb brings it")
    blender.run(*walk.stage_arguments(tmp_path))
    with screen.display(*walk.SIZE, folder=tmp_path) as name:
        window = replace(blender, command=("env", f"DISPLAY={name}", *blender.command))
        window.run(*walk.walk_arguments(tmp_path, tmp_path))
    pictures = sorted(tmp_path.glob("[0-9][0-9]_*.png"))
    assert len(pictures) == len((tmp_path / "walk.md").read_text().splitlines()) > 20
    assert all(shown(picture).std() > 0.05 for picture in pictures)


@pytest.mark.night("tests/addon/ui/test_panel.py")
def test_the_pages_pictures_of_the_panel_can_be_taken_again(tmp_path):
    """Small pictures, with the names of those that the pages show."""
    if shutil.which("Xvfb") is None:
        pytest.skip("no Xvfb: on Debian the package xvfb brings it")
    made = walk.screens(Path(binary_command()[0]), tmp_path)
    pages = sorted((ROOT / "docs" / "images" / "screens").iterdir())
    assert [picture.name for picture in made] == [picture.name for picture in pages]
    assert all(shown(picture).std() > 0.05 and picture.stat().st_size < 60_000 for picture in made)


def shown(path: Path) -> np.ndarray:
    """A picture as displayed (rows, cols, 3), 0 to 1."""
    with Image.open(path) as picture:
        return np.asarray(picture.convert("RGB"), float) / 255


@pytest.mark.night("tests/render/test_lights_move.py")
def test_the_viewport_follows_the_lamps(display, blender, tmp_path):
    file, bake = tmp_path / "plane.blend", tmp_path / "bake"
    blender.run_script(HERE / "make_plane.py", file)
    blender.run_grating("bake", "sample:blazed", "--delta-e", "6", "-o", bake)
    window = replace(blender, command=("env", f"DISPLAY={display}", *blender.command))
    window.run("--window-geometry", "0", "0", "480", "420", file, "--python", HERE / "watch_viewport.py", "--",
               bake / "blazed.exr", tmp_path)  # fmt: skip
    views, renders = ({path.stem.rpartition("_")[0]: shown(path) for path in tmp_path.glob(f"*_{what}.png")}
                      for what in ("view", "render"))  # fmt: skip
    before = None
    for step in ("assigned", "turned", "coloured", "animated", "area", "two more again"):
        # The same engine draws both with the same samples: equal up to 8-bit rounding.
        assert np.abs(views[step] - renders[step]).max() < 1.5 / 255, step
        # Orders move, or lose their green.
        assert before is None or np.abs(views[step] - before).max() > 0.5, step
        before = views[step]
    same = {
        "eye opened": "animated", "included": "area", "deleted, undone": "area", "two more, undone": "area",
        "two more again": "two more",
    }  # fmt: skip
    for step, earlier in same.items():
        assert np.abs(views[step] - views[earlier]).max() < 1.5 / 255, step
    for step in ("eye closed", "excluded", "deleted"):
        assert views[step].max() < 1.5 / 255, step
    # As in Blender, the eye icon hides a lamp only in the viewport.
    assert np.abs(renders["eye closed"] - renders["animated"]).max() < 1.5 / 255
    assert renders["excluded"].max() < 1.5 / 255


@pytest.mark.night("tests/addon/nodes/test_eevee_constants.py")
def test_two_bakes_under_eight_sources_are_not_magenta(display, blender, tmp_path):
    """EEVEE draws a material magenta if its constants exceed 64 KiB; this one has the most sources that are read."""
    file, picture = tmp_path / "plane.blend", tmp_path / "seen.png"
    blender.run_script(HERE / "make_plane.py", file)
    for name in ("blazed", "sinusoidal"):
        blender.run_grating("bake", f"sample:{name}", "--delta-e", "6", "-o", tmp_path)
    # Filters textures like a graphics card (addon/blender/mesa.py).
    filtered = "MESA_EXTENSION_OVERRIDE=-GL_EXT_texture_filter_anisotropic -GL_ARB_texture_filter_anisotropic"
    window = replace(blender, command=("env", f"DISPLAY={display}", filtered, *blender.command))
    window.run("--window-geometry", "0", "0", "480", "420", file, "--python", HERE / "watch_many_sources.py", "--",
               tmp_path / "blazed.exr", tmp_path / "sinusoidal.exr", picture)  # fmt: skip
    seen = shown(picture)
    red, green, blue = np.moveaxis(seen, -1, 0)
    # The colours of a spectrum vary from pixel to pixel; Blender's magenta for a failed shader is uniform.
    assert ((red > 0.9) & (green < 0.1) & (blue > 0.9)).mean() < 0.01
    assert seen.std() > 0.02, "no diffraction in the picture"


@pytest.mark.night("tests/addon/workflow/test_fitting_worlds.py")
def test_a_world_is_fitted_beside_the_artists_work(display, blender, tmp_path):
    window = replace(blender, command=("env", f"DISPLAY={display}", *blender.command))
    window.run("--window-geometry", "0", "0", "900", "700", "--python", HERE / "fit_world.py", "--", tmp_path)


def test_a_scan_is_dropped_previewed_levelled_baked_and_undone(blender, shared_data, tmp_path):
    if shutil.which("Xvfb") is None:
        pytest.skip("no Xvfb: on Debian the package xvfb brings it")
    shutil.copy(shared_data / "nanosurf" / "grid.nid", tmp_path)
    with screen.display(1280, 1400, folder=tmp_path) as shown:
        window = replace(blender, command=("env", f"DISPLAY={shown}", *blender.command))
        size = ("--enable-event-simulate", "--window-geometry", "0", "0", "1280", "1400")
        files = (tmp_path / "grid.nid", tmp_path / "Xvfb_screen0", tmp_path / "levelled.png")
        window.run(*size, "--python", HERE / "drop_scan.py", "--", *files)
