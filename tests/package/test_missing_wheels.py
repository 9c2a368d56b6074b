# SPDX-License-Identifier: GPL-3.0-or-later
"""The installed extension without one of its packages: it is enabled, its panels draw, and it says once what is
missing.

Blender itself refuses a zip that has no wheel at all for its Python. Linux's zip has OpenEXR alone for Python 3.14, so
there the other packages are always missing."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

HERE = Path(__file__).parent
MODULE = "bl_ext.user_default.natural_gratings"
# Common name of each package, by its import name.
PACKAGES = {"OpenEXR": "OpenEXR", "PIL": "Pillow", "xatlas": "xatlas"}
SAID = re.compile(r"^Natural Gratings: Missing packages: .*$", re.MULTILINE)


def remove_package(user_folder: Path, module: str) -> None:
    """Remove a package's files from the folder into which Blender has unpacked the extension's wheels."""
    for folder in (user_folder / "extensions" / ".local").glob("lib/python*/site-packages"):
        for path in folder.glob(f"{module}*"):
            if path.suffix == ".dist-info":
                continue
            shutil.rmtree(path) if path.is_dir() else path.unlink()


@pytest.mark.parametrize("module", PACKAGES)
@pytest.mark.short("bpy-5.3-OpenEXR", "OpenEXR-bpy-5.3")
def test_the_extension_without_a_package_is_enabled_and_says_so_once(blender, without_packages, tmp_path, module):
    shutil.copytree(blender.user_folder, tmp_path / "user", symlinks=True)
    remove_package(tmp_path / "user", module)
    bare = without_packages(replace(blender, user_folder=tmp_path / "user"), module)
    answer = bare.start("--background", "--command", "grating", "--help")
    assert answer.returncode == 0
    (said,) = SAID.findall(answer.stderr)
    assert f"{PACKAGES[module]} (" in said
    bare.run_script(HERE / "draw_panels.py", MODULE, PACKAGES[module])
