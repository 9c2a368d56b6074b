# SPDX-License-Identifier: GPL-3.0-or-later
"""The zip's files without wheels as a plain folder in scripts/addons/, as studios put add-ons on a render farm."""

import tomllib
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from devtools import ROOT

HERE = Path(__file__).parent
MODULE = "natural_gratings"
PACKAGES = {"OpenEXR": "OpenEXR", "PIL": "Pillow", "xatlas": "xatlas"}


@pytest.fixture
def blender(empty_blender, built, without_packages, tmp_path):
    """A Blender with the plain folder, whose Python has none of the packages."""
    folder = tmp_path / "user" / "scripts" / "addons" / MODULE
    with zipfile.ZipFile(built["linux_x64"]) as package:
        package.extractall(folder, [name for name in package.namelist() if not name.startswith("wheels/")])
    return without_packages(replace(empty_blender, user_folder=tmp_path / "user"), *PACKAGES)


@pytest.mark.night("test_its_command_works_and_says_once_what_is_missing")
def test_it_is_listed_drawn_and_used(blender, tmp_path):
    """Its name and version are in Blender's list, its panels draw, and a shipped draft becomes a saved material."""
    blender.run_script(HERE / "use_plain_folder.py", tmp_path / "plane.blend")
    arguments = ("--background", "--addons", MODULE, "--python-exit-code", "1", "--python", HERE / "draw_panels.py")
    blender.run(*arguments, "--", MODULE, *PACKAGES.values())
    assert (tmp_path / "plane.blend").is_file()


@pytest.mark.short("bpy-5.3")
def test_its_command_works_and_says_once_what_is_missing(blender, tmp_path):
    answer = blender.start("--background", "--addons", MODULE, "--command", "grating", "assign", "--help")
    assert answer.returncode == 0, answer.stderr
    (line,) = (line for line in answer.stderr.splitlines() if "Missing packages: OpenEXR (to bake), Pillow (" in line)
    assert "Install the extension's zip in place of this folder, or these for " in line


def test_it_describes_itself_as_the_extension_does():
    given: dict = {}
    exec((ROOT / "__init__.py").read_text(), given)
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
    info = given["bl_info"]
    assert ".".join(map(str, info["version"])) == manifest["version"]
    assert ".".join(map(str, info["blender"])) == manifest["blender_version_min"]
    assert (info["name"], info["description"], info["author"], info["category"]) == (
        manifest["name"], manifest["tagline"], manifest["maintainer"], manifest["tags"][0],
    )  # fmt: skip
