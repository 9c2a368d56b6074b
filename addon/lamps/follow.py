# SPDX-License-Identifier: GPL-3.0-or-later
"""Finding out which lamps the scene's properties follow, and making the properties follow the scene's present lamps."""

import bpy

from .find import LAMPS_MAX, find_lamps, lamps_of
from .link import mark_unlinked
from .pack import PROPERTIES, drive_properties, property_name


def followed_lamps(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The lamps that the scene's properties follow, as their drivers say."""
    drivers = scene.animation_data.drivers if scene.animation_data else ()
    found = {}
    for curve in drivers:
        for index in range(LAMPS_MAX):
            # The driver of the first number reads the lamp's object. The driver of the fourth may read the lamp's data
            # alone.
            if curve.array_index == 0 and curve.data_path == f'["{property_name(index, "place")}"]':
                found[index] = curve.driver.variables[0].targets[0].id
    return [found[index] for index in sorted(found)]


def follow_lamps(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Make the scene's properties follow its lamps, at most LAMPS_MAX of them; the lamps that are followed.

    Raises GratingError if there is no lamp."""
    lamps = find_lamps(scene)[:LAMPS_MAX]
    stop_following(scene)
    for index, lamp in enumerate(lamps):
        drive_properties(scene, index, lamp)
        mark_unlinked(scene, index, lamp)
    return lamps


def stop_following(scene: bpy.types.Scene) -> None:
    """Remove the drivers and the properties."""
    names = [property_name(index, what) for index in range(LAMPS_MAX) for what in PROPERTIES]
    for name in names:
        if name in scene:
            scene.driver_remove(f'["{name}"]')
            del scene[name]


def lamp_count(scene: bpy.types.Scene) -> int:
    """How many lamps the scene's properties describe."""
    return sum(property_name(index, "place") in scene for index in range(LAMPS_MAX))


def is_up_to_date(scene: bpy.types.Scene) -> bool:
    """Whether the properties follow the lamps that the scene has now."""
    lamps = lamps_of(scene)
    followed = followed_lamps(scene)
    return len(followed) == min(len(lamps), LAMPS_MAX) and all(lamp in lamps for lamp in followed)
