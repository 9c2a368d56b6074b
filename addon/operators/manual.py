# SPDX-License-Identifier: GPL-3.0-or-later
"""Opens the manual that the zip ships: a button in the panel's header, in the menu, and in Blender's preferences."""

import webbrowser
from pathlib import Path

import bpy

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded_draw
from ..gratings.cache_folder import EXTENSION
from .shared import Acts

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
