# SPDX-License-Identifier: GPL-3.0-or-later
"""Warning about objects that show light from outside the region for which their grating was baked: there they are
black.

A few rays are cast through the scene's camera in the present frame, which takes a tenth of a second."""

import bpy

from ...precompute.bake.shown_directions import Shown, held_share, joined, left_out
from ..cameras.camera_look import look
from ..gratings.baked_region import has_regions, note_outside, noted_region
from ..materials.response import Response, responses_in

# Number of rays, and the smallest share of an object's light that gives a warning: the needs leave out a thousandth,
# and with so few rays the error is a few times that.
_RAYS, _WORTH_A_WORD = 2000, 0.005


def notice_outside(scene: bpy.types.Scene) -> list[str]:
    """A warning for each object that shows light from outside the region of its grating's bake: the share of its light,
    and how far it reaches. It checks the open scene as last evaluated; for any other scene it returns nothing."""
    if not has_regions() or scene != bpy.context.scene:
        note_outside(scene, [])
        return []
    seen = look(scene, bpy.context.evaluated_depsgraph_get(), rays=_RAYS)
    parts: dict[tuple[bpy.types.Object, Response], list[Shown]] = {}
    if seen is not None:
        for places in seen.places:
            for response in responses_in(places.node.node_tree):
                parts.setdefault((places.thing, response), []).append(seen.shown(response, places))
    told = [_told(thing, response, joined(shown)) for (thing, response), shown in parts.items()]
    lines = [line for line in told if line]
    note_outside(scene, lines)
    return lines


def _told(thing: bpy.types.Object, response: Response, shown: Shown) -> str:
    """The warning about one object; empty if there is nothing to warn about."""
    region = noted_region(response.group)
    if region is None or shown.is_dark or (outside := 1 - held_share(shown, region)) < _WORTH_A_WORD:
        return ""
    reached = "; ".join(left_out(shown, region, share=_WORTH_A_WORD / 6))
    return (
        f"{thing.name}: {outside:.0%} of its light is black, because its grating was baked for another camera or other "
        f"lamps ({reached}); press Bake for This Scene again"
    )
