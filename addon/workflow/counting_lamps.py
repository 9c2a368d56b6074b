# SPDX-License-Identifier: GPL-3.0-or-later
"""Leaving a lamp out of the diffraction, or keeping it in."""

import bpy

from ...precompute.base.failure import GratingError
from ..blender.window import has_window
from ..lamps.find import COUNTS, LAMPS_MAX, brightest, is_kept, lamps_of
from ..lamps.follow import counted_lamps, followed_lamps
from ..materials.group_properties import diffraction_groups
from .following_lamps import lit_boxes, update_lamps


def count_lamp(scene: bpy.types.Scene, name: str, active: bpy.types.Object | None = None) -> list[str]:
    """Leave a lamp out if it lights the diffraction, else keep it in. Without a name it is the active object. Returns
    lines to report. Raises GratingError, with nothing changed, if the scene has no such lamp, if the lamp belongs to
    another file, or if too many are kept in."""
    lamp = _lamp_named(scene, name, active)
    if lamp.library is not None or lamp.override_library is not None:
        raise GratingError(
            lamp.name, "linked from another file", "leave it out in that file, or use Object > Relations > Make Local"
        )
    if lamp in counted_lamps(scene):
        lamp[COUNTS] = False
        done = "left out of the diffraction"
    elif sum(map(is_kept, lamps_of(scene))) < LAMPS_MAX:
        lamp.pop(COUNTS, None)
        if lamp not in brightest(scene, followed=followed_lamps(scene), lit=lit_boxes):
            lamp[COUNTS] = True
        done = "lights the diffraction"
    else:
        raise GratingError(lamp.name, f"{LAMPS_MAX} other lamps are kept in", "leave one of them out first")
    lamp.update_tag()
    if diffraction_groups():
        update_lamps(scene, in_viewport=has_window())
    return [f"{lamp.name}: {done}"]


def keep_lamp(scene: bpy.types.Scene, name: str, *, counts: bool) -> list[str]:
    """Make a named lamp light the diffraction, or leave it out. Returns lines to report. Raises GratingError as
    count_lamp does."""
    if (_lamp_named(scene, name, None) in counted_lamps(scene)) != counts:
        return count_lamp(scene, name)
    return [f"{name}: {'lights the diffraction' if counts else 'left out of the diffraction'} already"]


def _lamp_named(scene: bpy.types.Scene, name: str, active: bpy.types.Object | None) -> bpy.types.Object:
    lamps = lamps_of(scene)
    found = [lamp for lamp in lamps if (lamp.name == name if name else lamp == active)]
    if found:
        return min(found, key=lambda lamp: lamp.library is not None)
    if not name:
        raise GratingError(f"scene {scene.name}", "no lamp is active", "make the lamp the active object")
    raise GratingError(name, "no lamp of the scene", f"there are {', '.join(sorted(lamp.name for lamp in lamps))}")
