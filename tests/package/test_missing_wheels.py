# SPDX-License-Identifier: GPL-3.0-or-later
"""The zip without one of its packages: it installs, its panels draw, and it says once what is missing."""

import re
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

HERE = Path(__file__).parent
MODULE = "bl_ext.user_default.natural_gratings"
# Wheel, import name and common name of each package.
PACKAGES = {"openexr": ("OpenEXR", "OpenEXR"), "pillow": ("PIL", "Pillow"), "xatlas": ("xatlas", "xatlas")}
SAID = re.compile(r"^Natural Gratings: Missing packages: .*$", re.MULTILINE)


def without_wheels(package: Path, wheel: str, target: Path) -> Path:
    """A copy of the zip without the wheels of a package, also in its manifest."""
    with zipfile.ZipFile(package) as whole, zipfile.ZipFile(target, "w") as part:
        for item in whole.infolist():
            held = whole.read(item)
            if item.filename == "blender_manifest.toml":
                lines = held.decode().splitlines(keepends=True)
                held = "".join(line for line in lines if f"wheels/{wheel}-" not in line).encode()
            if f"wheels/{wheel}-" not in item.filename:
                part.writestr(item, held)
    return target


@pytest.mark.parametrize("wheel", PACKAGES)
def test_the_extension_without_a_package_installs_and_says_so_once(
    empty_blender, built, without_packages, tmp_path, wheel
):
    module, name = PACKAGES[wheel]
    blender = without_packages(replace(empty_blender, user_folder=tmp_path / "user"), module)
    package = without_wheels(built["linux_x64"], wheel, tmp_path / "natural_gratings.zip")
    blender.run_script(HERE / "install.py", package)
    answer = blender.start("--background", "--command", "grating", "--help")
    assert answer.returncode == 0
    (said,) = SAID.findall(answer.stderr)
    assert f"{name} (" in said
    blender.run_script(HERE / "draw_panels.py", MODULE, name)
