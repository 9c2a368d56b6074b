# SPDX-License-Identifier: GPL-3.0-or-later
"""The cache folder, and the place of a bake in it."""

import hashlib
import os
from pathlib import Path

import bpy

# The extension's package, or the add-on's own if it is not installed as an extension.
EXTENSION = __package__.rpartition(".addon.")[0]


def cache_folder() -> Path:
    """The cache folder: $NATURAL_GRATINGS_CACHE, else the extension's folder in Blender. It may not exist yet."""
    from ...precompute.bake import cache

    if EXTENSION.startswith("bl_ext.") and not os.environ.get(cache.FOLDER_VARIABLE):
        return Path(bpy.utils.extension_path_user(EXTENSION, path="cache"))
    return cache.default_folder()


def bakes_folder(request: str) -> Path:
    """The cache's folder for the bake of a request, given as the text of gratings/bakes.py's `asked`."""
    return cache_folder() / "bakes" / hashlib.sha256(request.encode()).hexdigest()[:16]
