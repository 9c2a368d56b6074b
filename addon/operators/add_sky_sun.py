# SPDX-License-Identifier: GPL-3.0-or-later
"""Replaces the sun disc of the world's sky by a sun lamp."""

import bpy

from ...precompute.base.failure import GratingError
from ..lamps.sky_sun import sky_with_disc
from .polls import in_object_mode
from .reports import report_failure, report_lines


class AddSkySun(bpy.types.Operator):
    """Add a sun lamp with the direction, size, colour and strength of the sky's sun, and switch the Sky Texture's Sun
    Disc off. In EEVEE the disc lights only gratings, and the lamp lights everything. Takes some seconds"""

    bl_idname = "grating.add_sky_sun"
    bl_label = "Add Sun Lamp for the Sky"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if not in_object_mode(cls, context):
            return False
        if sky_with_disc(context.scene.world) is None:
            cls.poll_message_set("Give the world a Sky Texture with its Sun Disc on first")
            return False
        return True

    def execute(self, context):
        from ..workflow.adding_sky_suns import replace_disc

        try:
            return report_lines(self, [replace_disc(context.scene)])
        except GratingError as error:
            return report_failure(self, error)
