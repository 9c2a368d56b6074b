# SPDX-License-Identifier: GPL-3.0-or-later
"""One sentence about the bundled packages that this Blender's Python lacks: in the panel, or in background on the
console. Distributions build Blender with a newer Python, and a copied folder has no wheels."""

import sys

import bpy

from ...precompute.base.machine import missing_packages
from ..gratings.cache_folder import EXTENSION
from ..gratings.wording import marked, translated
from .notes import draw_note

# What each package is for.
_USES = {
    "OpenEXR": marked("OpenEXR (to bake)"),
    "Pillow": marked("Pillow (to read PNG, TIFF and BMP scans)"),
    "xatlas": marked("xatlas (to unwrap other than by Minimum Stretch)"),
}


def missing_line() -> str:
    """The sentence: which packages are missing, what each is for, and what to do. Empty if none is missing."""
    names = missing_packages()
    if not names:
        return ""
    remedy = marked("Install them for this Blender's Python {version}.")
    if not EXTENSION.startswith("bl_ext."):
        remedy = marked("Install the extension's zip in place of this folder, or these for Python {version}.")
    return " ".join([
        translated("Missing packages: {uses}.", uses=", ".join(translated(_USES[name]) for name in names)),
        translated(remedy, version=".".join(map(str, sys.version_info[:2]))),
    ])  # fmt: skip


def draw_missing(layout, context) -> None:
    """Draw the sentence, if a package is missing."""
    if line := missing_line():
        draw_note(layout, context, line, icon="INFO")


def print_missing() -> None:
    """Print the sentence to standard error if a package is missing and no panel can show it."""
    if bpy.app.background and (line := missing_line()):
        print(f"Natural Gratings: {line}", file=sys.stderr)
