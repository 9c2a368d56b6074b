# SPDX-License-Identifier: GPL-3.0-or-later
"""Making diffraction follow a scene's lamps: which of them count, and a sun lamp in place of the disc of the world's
sky."""

from math import radians
from typing import TYPE_CHECKING

import bpy

from ....precompute.base.failure import GratingError
from ...blender.session import has_window
from ...lamps.brightest_lamps import (
    AUTO,
    COUNTS,
    FOLLOWED_MAX,
    KEPT,
    LEFT_OUT,
    brightest,
    instanced_lamps,
    instances_are_not_followed,
    is_kept,
    lamps_of,
    unfollowed_features,
)
from ...lamps.follow import counted_lamps, follow_lamps, followed_lamps
from ...lamps.light_linking import is_linked, mark_unlinked
from ...lamps.sky import SOURCES_MAX, add_sky_sun, sky_with_disc
from ...materials.data_pictures import wrong_colours
from ...materials.group_properties import diffraction_groups
from ...materials.skin import follows_light_linking, linked_with_fewer_lamps, needs_lamps, show_lamps
from .fitting_worlds import unfitted_world

if TYPE_CHECKING:
    import numpy as np


# The sun that the panel adds: irradiance in W/m2, and rotation.
_SUN_STRENGTH, _SUN_TURN = 3.0, (radians(40), 0.0, radians(30))


def update_lamps(scene: bpy.types.Scene, *, exactly: bool = True, in_viewport: bool = False) -> None:
    """Follow the scene's present lamps, the brightest FOLLOWED_MAX of them, and give Diffraction groups enough lamps.

    `exactly`: also remove lamps that are not needed (skin.show_lamps). `in_viewport`: lamps hidden there are dark."""
    lamps = follow_lamps(scene, in_viewport=in_viewport, lit=lit_boxes)
    show_lamps(exactly=exactly)
    if any(is_linked(lamp) for lamp in lamps) or follows_light_linking():
        mark_unlinked(scene, lamps)


def lit_boxes(scene: bpy.types.Scene) -> "np.ndarray":
    """The bounding boxes of the scene's objects that show diffraction (material.boxes_showing)."""
    from ...materials.material import boxes_showing  # most files never need this module

    return boxes_showing(scene)


def update_all_lamps(*, exactly: bool = True, in_viewport: bool = False) -> None:
    """Call update_lamps for each scene of the file that is not linked."""
    for scene in bpy.data.scenes:
        if scene.library is None:
            update_lamps(scene, exactly=exactly, in_viewport=in_viewport)


def _lines_on_spectra(scene: bpy.types.Scene) -> list[str]:
    """A warning for each grating whose colours are off under the spectra of the scene's lamps."""
    from ...materials.lamp_errors import far_lamps  # most files never need this module

    return [
        f"{group.name}: {line}; bake it for these lamps"
        for group in diffraction_groups()
        for line in far_lamps(group, scene)
    ]


def add_sun(scene: bpy.types.Scene) -> bpy.types.Object:
    """Add a slanting sun to the scene and return it."""
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy = _SUN_STRENGTH
    sun = bpy.data.objects.new("Sun", data)
    sun.rotation_euler = _SUN_TURN
    scene.collection.objects.link(sun)
    return sun


def warnings_about(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> list[str]:
    """Warnings about lamps and their features that diffraction does not follow, and about settings that give wrong
    colours."""
    from ...materials.material import outside_light_groups  # Blender's start does not need it

    counted = counted_lamps(scene)
    lines = []
    if not counted and needs_lamps():
        which = "all its lamps are left out" if lamps_of(scene) else "it has no lamp"
        remedy = "keep one in" if lamps_of(scene) else "add a sun"
        lines = [f"scene {scene.name}: {which}, so with Lamps Only the diffraction is black; {remedy}"]
    lines += unfollowed_features(scene, counted) + unfitted_world(scene)
    lines += linked_with_fewer_lamps(scene) + outside_light_groups(scene)
    lines += wrong_colours(scene) + _lines_on_spectra(scene)
    instanced = instanced_lamps(depsgraph)
    return [*lines, instances_are_not_followed(instanced)] if instanced else lines


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
        setattr(lamp, COUNTS, LEFT_OUT)
        done = "left out of the diffraction"
    elif sum(map(is_kept, lamps_of(scene))) < FOLLOWED_MAX:
        setattr(lamp, COUNTS, AUTO)
        if lamp not in brightest(scene, followed=followed_lamps(scene), lit=lit_boxes):
            setattr(lamp, COUNTS, KEPT)
        done = "lights the diffraction"
    else:
        raise GratingError(lamp.name, f"{FOLLOWED_MAX} other lamps are kept in", "leave one of them out first")
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


# The widest radius of a fitted source over the disc's own: the source has the disc's glow around it.
_WIDEST = 2.0


def replace_disc(scene: bpy.types.Scene) -> str:
    """Add a sun lamp with the direction, size, colour and irradiance of the sky's sun, and switch the sun disc off, so
    that no light counts twice. Returns a line to report. Raises GratingError, with nothing changed, if the world shows
    no sun disc or cannot be changed, or as world_probe.fit_of does."""
    from ...worlds.world_probe import fit_of

    world = scene.world
    sky = sky_with_disc(world)
    if world is None or sky is None:
        raise GratingError(f"scene {scene.name}", "its world shows no sky with a sun disc", "add a Sky Texture")
    if world.library is not None:
        raise GratingError(f"world {world.name}", "it is linked from another file", "make it local")
    narrow = (_WIDEST * sky.sun_size / 2) ** 2 / 4
    found = [source for source in fit_of(world, scene, SOURCES_MAX).sources if source.variance < narrow]
    if not found:
        raise GratingError(f"world {world.name}", "its sun is not seen", "raise the sun above the horizon")
    sun = add_sky_sun(scene, sky, max(found, key=lambda source: source.irradiance.sum()))
    update_lamps(scene)
    again = "if you turn the sky, switch the disc on and press again"
    return f"{sun.name}: lights everything in place of the sun disc; {again}"
