# SPDX-License-Identifier: GPL-3.0-or-later
"""What this copy of the extension came with: the manual, which a button opens, and the bundled packages. One sentence
names the packages that this Blender's Python lacks, in the panel, or in background on the console. Distributions build
Blender with a newer Python, and a copied folder has no wheels."""

import sys
import webbrowser
from pathlib import Path

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.base.machine import missing_packages
from ..blender.guard import guarded_draw
from ..gratings.cache_folder import EXTENSION
from ..gratings.wording import marked, translated
from ..operators.shared import Acts
from .notes import draw_note

# The site of `./dev docs`. `./dev build` puts it into the zip.
MANUAL = Path(__file__).parents[2] / "manual" / "index.html"


class OpenManual(Acts, bpy.types.Operator):
    """Open the manual in your web browser. It came with the extension, so it needs no network"""

    bl_idname = "grating.manual"
    bl_label = "Open Manual"

    @classmethod
    def poll(cls, context):
        if not MANUAL.is_file():
            cls.poll_message_set("This copy of the extension has no manual")
        return MANUAL.is_file()

    def act(self, context):
        if not webbrowser.open(MANUAL.as_uri()):
            raise GratingError(MANUAL, "no web browser was found", "open this file in a browser")
        return [str(MANUAL)]


class Preferences(bpy.types.AddonPreferences):
    """What Preferences > Add-ons shows of the extension"""

    bl_idname = EXTENSION

    @guarded_draw
    def draw(self, context):
        draw_manual(self.layout, text=OpenManual.bl_label)


def draw_manual(layout, *, text: str, emboss: bool = True) -> None:
    """Draw the button, if this copy of the extension has a manual."""
    if MANUAL.is_file():
        layout.operator(OpenManual.bl_idname, text=text, icon="HELP", emboss=emboss)


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
