# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by a Blender with the extension: checks that the add-on and its packages come from the zip.

Use a later session than the one that installs, where Blender puts the extensions' packages last on Python's path.
"""

import sys
from pathlib import Path

import bpy

extensions = Path(bpy.utils.user_resource("EXTENSIONS")).resolve()


def check(name: str, folder: Path) -> None:
    """Assert that the module comes from a folder inside the user's extensions."""
    __import__(name)
    file = Path(sys.modules[name].__file__).resolve()
    assert file.is_relative_to(extensions / folder), f"{name} comes from {file}"


check("bl_ext.user_default.natural_gratings", Path("user_default", "natural_gratings"))
# The zip has OpenEXR alone for the Python 3.14 of Linux distributions.
for package in ("OpenEXR",) if sys.version_info >= (3, 14) else ("OpenEXR", "PIL", "xatlas"):
    check(package, Path(".local"))
