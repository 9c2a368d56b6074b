# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done about lamps by operators and by Blender's own events."""

import contextlib

import bpy
from bpy.app.handlers import persistent

from ...precompute.base.failure import GratingError
from ..lamps.follow import follow_lamps, followed_lamps
from ..lamps.link import mark_unlinked


@persistent
def follow_after_import(*_) -> None:
    """After an append or a link of diffraction: a scene that follows no lamps yet does so now, and no object keeps the
    light linking of the file that it came from."""
    from ..materials.skin import is_diffraction  # materials build on this module
    from ..materials.skin import show_lamps as show_key_lights

    if not any(is_diffraction(group) for group in bpy.data.node_groups):
        return
    for scene in bpy.data.scenes:
        if scene.library is None:
            _follow_or_mark(scene)
    show_key_lights()


def _follow_or_mark(scene: bpy.types.Scene) -> None:
    followed = followed_lamps(scene)
    for index, lamp in enumerate(followed):
        if lamp is not None and lamp.type == "LIGHT":
            mark_unlinked(scene, index, lamp)
    if not followed:
        with contextlib.suppress(GratingError):  # no lamp yet: the panel says so
            follow_lamps(scene)
