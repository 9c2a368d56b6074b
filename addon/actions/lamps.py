# SPDX-License-Identifier: GPL-3.0-or-later
"""Making diffraction follow the scene's lamps, when a user asks for it and after an import."""

import contextlib

import bpy
from bpy.app.handlers import persistent

from ...precompute.base.failure import GratingError
from ..lamps.find import instanced_lamps, instances_are_not_followed, unfollowed_features
from ..lamps.follow import follow_lamps, followed_lamps
from ..lamps.link import mark_unlinked
from ..materials.skin import is_diffraction, linked_with_fewer_lamps, show_lamps


def update_lamps(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Follow the lamps that the scene has now, and give the file's Diffraction groups the same number of lamps.

    Returns the lamps that are followed.

    Raises GratingError, with nothing changed, if there is no lamp."""
    lamps = follow_lamps(scene)
    show_lamps()
    return lamps


def warnings_about(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> list[str]:
    """One line for each thing about the scene's lamps that diffraction does not follow."""
    lines = unfollowed_features(scene) + linked_with_fewer_lamps(scene)
    instanced = instanced_lamps(depsgraph)
    return [*lines, instances_are_not_followed(instanced)] if instanced else lines


@persistent
def follow_after_import(*_: object) -> None:
    """Called after Blender has appended or linked data: a scene that has diffraction and follows no lamps follows
    them from now on. Objects lose the marks of light linking that came with them from the other file."""
    if not any(is_diffraction(group) for group in bpy.data.node_groups):
        return
    for scene in bpy.data.scenes:
        if scene.library is None:
            _follow_or_mark(scene)
    show_lamps()


def _follow_or_mark(scene: bpy.types.Scene) -> None:
    followed = followed_lamps(scene)
    for index, lamp in enumerate(followed):
        if lamp is not None and lamp.type == "LIGHT":
            mark_unlinked(scene, index, lamp)
    if not followed:
        with contextlib.suppress(GratingError):  # no lamp yet: the panel says so
            follow_lamps(scene)
