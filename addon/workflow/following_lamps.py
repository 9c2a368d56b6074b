# SPDX-License-Identifier: GPL-3.0-or-later
"""Making diffraction follow a scene's lamps."""

from math import radians
from typing import TYPE_CHECKING

import bpy

from ..lamps.find import instanced_lamps, instances_are_not_followed, lamps_of, unfollowed_features
from ..lamps.follow import counted_lamps, follow_lamps
from ..lamps.light_linking import is_linked, mark_unlinked
from ..materials.data_pictures import wrong_colours
from ..materials.file_lights import follows_light_linking, linked_with_fewer_lamps
from ..materials.group_properties import diffraction_groups
from ..materials.skin import needs_lamps, show_lamps
from .fitting_worlds import unfitted_world

if TYPE_CHECKING:
    import numpy as np

# The sun that the panel adds: irradiance in W/m2, and rotation.
_SUN_STRENGTH, _SUN_TURN = 3.0, (radians(40), 0.0, radians(30))


def update_lamps(scene: bpy.types.Scene, *, exactly: bool = True, in_viewport: bool = False) -> None:
    """Follow the scene's present lamps, the brightest LAMPS_MAX of them, and give Diffraction groups enough lamps.

    `exactly`: also remove lamps that are not needed (skin.show_lamps). `in_viewport`: lamps hidden there are dark."""
    lamps = follow_lamps(scene, in_viewport=in_viewport, lit=lit_boxes)
    show_lamps(exactly=exactly)
    if any(is_linked(lamp) for lamp in lamps) or follows_light_linking():
        mark_unlinked(scene, lamps)


def lit_boxes(scene: bpy.types.Scene) -> "np.ndarray":
    """The bounding boxes of the scene's objects that show diffraction (group_users.boxes_showing)."""
    from ..materials.group_users import boxes_showing  # most files never need this module

    return boxes_showing(scene)


def update_all_lamps(*, exactly: bool = True, in_viewport: bool = False) -> None:
    """Call update_lamps for each scene of the file that is not linked."""
    for scene in bpy.data.scenes:
        if scene.library is None:
            update_lamps(scene, exactly=exactly, in_viewport=in_viewport)


def _lines_on_spectra(scene: bpy.types.Scene) -> list[str]:
    """A warning for each grating whose colours are off under the spectra of the scene's lamps."""
    from ..materials.lamp_errors import far_lamps  # most files never need this module

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
    from ..materials.group_users import outside_light_groups  # Blender's start does not need it

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
