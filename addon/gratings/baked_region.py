# SPDX-License-Identifier: GPL-3.0-or-later
"""The region that a bake holds, noted on the node group that reads its table, and what was noticed of scenes that left
it. Saved .blend files hold the note's name: it must stay."""

from typing import TYPE_CHECKING

import bpy

from ..blender import stored

if TYPE_CHECKING:
    from ...precompute.bake.needs import Needs
    from ...precompute.table.atlas import Layout

# The lowest and the highest u, v and w, one after the other. A group without it holds every direction.
_REGION = "ng_region"
# No bound is farther from 0, up to rounding.
_FARTHEST = 2.0 + 1e-6
# What was noticed, by the scenes' full names, for the panel.
_noticed: dict[str, list[str]] = {}


def note_region(group: bpy.types.NodeTree, layout: "Layout") -> None:
    """Note which part of (u, v, w) a table of this layout holds, unless it holds all."""
    (u, v), w = layout.region, (layout.w_min, layout.w_max)
    if not (layout.region.is_whole and w == (0.0, 2.0)):
        group[_REGION] = [*u, *v, *w]


def noted_region(group: bpy.types.NodeTree) -> "Needs | None":
    """What a node group's table holds; None if that is every direction."""
    from ...precompute.bake.needs import Needs
    from ...precompute.optics.region import Region

    held = stored.numbers(group, _REGION, 6)
    if held is None or not _is_region(held):
        return None
    u_low, u_high, v_low, v_high, w_low, w_high = held
    return Needs(Region((u_low, u_high), (v_low, v_high)), (w_low, w_high))


def _is_region(held: tuple[float, ...]) -> bool:
    """Whether the bounds are in the order and the range of (u, v, w)."""
    return all(-_FARTHEST <= low < high <= _FARTHEST for low, high in zip(held[::2], held[1::2], strict=True))


def has_regions() -> bool:
    """Whether some table of the file holds less than every direction."""
    return any(_REGION in group for group in bpy.data.node_groups)


def note_outside(scene: bpy.types.Scene, lines: list[str]) -> None:
    """Note what was noticed of a scene; no line if all is well."""
    _noticed[scene.name_full] = lines


def noticed_outside(scene: bpy.types.Scene) -> list[str]:
    """The lines that were noted when the scene was last looked at."""
    return _noticed.get(scene.name_full, [])
