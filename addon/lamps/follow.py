# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lamps the scene's properties follow, and making them follow the lamps that are in the scene now.

A scene without lamps has no properties. Nodes then read 0, and the diffraction is black. Lamps that the artist leaves
out have properties too, with indices from LAMPS_MAX on: nodes that sample light at random read them to see nothing of
these lamps."""

from collections.abc import Sequence

import bpy

from ..blender import stored
from .brightest_lamps import LAMPS_MAX, LEFT_OUT_MAX, LitBoxes, brightest, lamps_left_out
from .drivers import Drivers
from .lamp_drivers import ON, PROPERTIES, SPECTRUM, drive_properties, property_name
from .rendered_lamps import note_shown

# The indices of the lamps that light diffraction, and of lamps that the artist leaves out.
_COUNTED, _LEFT_OUT = range(LAMPS_MAX), range(LAMPS_MAX, LAMPS_MAX + LEFT_OUT_MAX)
_FIRST = {f'["{property_name(index, "place")}"]': index for index in (*_COUNTED, *_LEFT_OUT)}


def followed_lamps(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The lamps that light diffraction, read from the drivers of the scene's properties. Deleted lamps are skipped."""
    return _read(scene, _COUNTED)


def left_out_lamps(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The lamps that the artist leaves out and the scene's properties hold. Deleted lamps are skipped."""
    return _read(scene, _LEFT_OUT)


def has_lost_lamps(scene: bpy.types.Scene) -> bool:
    """Whether a lamp that the scene's properties follow was deleted."""
    return len(_read(scene, [*_COUNTED, *_LEFT_OUT])) < lamp_count(scene) + left_out_count(scene)


def _read(scene: bpy.types.Scene, indices: Sequence[int]) -> list[bpy.types.Object]:
    if _count(scene, indices) == 0 or scene.animation_data is None:
        return []
    found = {}
    for curve in scene.animation_data.drivers:
        if curve.array_index == 0 and _FIRST.get(curve.data_path) in indices:
            found[_FIRST[curve.data_path]] = _lamp_of(curve.driver)
    return [lamp for _, lamp in sorted(found.items(), key=lambda item: item[0]) if lamp is not None]


def _lamp_of(driver: bpy.types.Driver) -> bpy.types.Object | None:
    """The lamp that a driver reads first; None if it was deleted, or if an artist edited the driver."""
    read = [target.id for variable in driver.variables for target in variable.targets][:1]
    return next((each for each in read if isinstance(each, bpy.types.Object) and each.type == "LIGHT"), None)


def counted_lamps(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The lamps that the scene's properties follow; if there are none, the lamps that they would follow."""
    return followed_lamps(scene) or brightest(scene)


def follow_lamps(
    scene: bpy.types.Scene, *, in_viewport: bool = False, lit: LitBoxes | None = None
) -> list[bpy.types.Object]:
    """Make the scene's properties follow its lamps, at most FOLLOWED_MAX. Return the followed lamps.

    Unchanged drivers are not written. Lamps that are already followed stay before new ones, so that a change of
    strength keeps their order. With `in_viewport`, lamps hidden only in the viewport count as hidden. `lit` finds the
    boxes that the lamps light, to choose the brightest of too many lamps (brightest_lamps.brightest)."""
    followed = followed_lamps(scene)
    chosen = brightest(scene, followed=followed, lit=lit)
    before = [lamp for lamp in followed if lamp in chosen]
    lamps = before + [lamp for lamp in chosen if lamp not in before]
    drivers = Drivers(scene)
    changed = False
    for index, lamp in enumerate(lamps):
        changed |= drive_properties(drivers, index, lamp)
    left_out = lamps_left_out(scene)[:LEFT_OUT_MAX]
    for index, lamp in zip(_LEFT_OUT, left_out, strict=False):
        changed |= drive_properties(drivers, index, lamp)
    changed |= _forget(drivers, [*_COUNTED[len(lamps) :], *_LEFT_OUT[len(left_out) :]])
    update_shown(scene, lamps, in_viewport=in_viewport)
    if changed:
        scene.update_tag()
    return lamps


def update_shown(scene: bpy.types.Scene, lamps: list[bpy.types.Object], *, in_viewport: bool) -> None:
    """Store which of the followed lamps each view layer shows (rendered_lamps.py)."""
    if note_shown(scene, lamps, in_viewport=in_viewport):
        scene.update_tag()


def stop_following(scene: bpy.types.Scene) -> None:
    """Remove all drivers and properties."""
    _forget(Drivers(scene), [*_COUNTED, *_LEFT_OUT])
    note_shown(scene, [], in_viewport=False)


def _forget(drivers: Drivers, indices: Sequence[int]) -> bool:
    """Remove the drivers and properties of lamps. Return whether any existed."""
    names = [property_name(index, what) for index in indices for what in (*PROPERTIES, ON, SPECTRUM)]
    removed = [drivers.remove(name) for name in names]
    return any(removed)


def is_on(scene: bpy.types.Scene, index: int) -> bool:
    """Whether the followed lamp with this index was shown when Blender last evaluated the scene."""
    return (stored.numbers(scene, property_name(index, ON), 1) or (0.0,))[0] > 0


def coloured_lamps(scene: bpy.types.Scene) -> set[int]:
    """The indices of the followed lamps that may have another spectrum than white."""
    return {index for index in range(lamp_count(scene)) if property_name(index, SPECTRUM) in scene}


def lamp_count(scene: bpy.types.Scene) -> int:
    """The number of lamps that light diffraction by the scene's properties."""
    return _count(scene, _COUNTED)


def left_out_count(scene: bpy.types.Scene) -> int:
    """The number of lamps that the artist leaves out and the scene's properties hold."""
    return _count(scene, _LEFT_OUT)


def _count(scene: bpy.types.Scene, indices: Sequence[int]) -> int:
    return sum(property_name(index, "place") in scene for index in indices)
