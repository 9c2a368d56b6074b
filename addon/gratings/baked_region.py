# SPDX-License-Identifier: GPL-3.0-or-later
"""The region of directions that a bake holds, stored on the node group that reads its table, and warnings about scenes
outside it. Saved .blend files contain the property's name, so it must not change."""

from typing import TYPE_CHECKING

import bpy

from ..blender import stored

if TYPE_CHECKING:
    from ...precompute.bake.needs import Needs
    from ...precompute.table.atlas import Layout

# The bounds of u, v and w, each as low, high. A group without this property holds all directions.
_REGION = "ng_region"
# The largest valid bound, with a margin for rounding.
_FARTHEST = 2.0 + 1e-6
# The warnings for the panel, by the full name of the scene.
_noticed: dict[str, list[str]] = {}


def note_region(group: bpy.types.NodeTree, layout: "Layout") -> None:
    """Store the part of (u, v, w) that a table of this layout holds, unless it holds all. Under a plate, it is the part
    of the directions above the plate."""
    from ...precompute.optics.plate import w_above_plate

    if not layout.whole:
        u, v = ((low * layout.plate_ior, high * layout.plate_ior) for low, high in layout.region)
        group[_REGION] = [*u, *v, *w_above_plate((layout.w_min, layout.w_max), layout.plate_ior)]


def noted_region(group: bpy.types.NodeTree) -> "Needs | None":
    """The region that a node group's table holds; None if it holds all directions."""
    from ...precompute.bake.needs import Needs
    from ...precompute.optics.region import Region

    held = stored.numbers(group, _REGION, 6)
    if held is None or not _is_region(held):
        return None
    u_low, u_high, v_low, v_high, w_low, w_high = held
    return Needs(Region((u_low, u_high), (v_low, v_high)), (w_low, w_high))


def _is_region(held: tuple[float, ...]) -> bool:
    """Whether the bounds are in order and within the range of (u, v, w)."""
    return all(-_FARTHEST <= low < high <= _FARTHEST for low, high in zip(held[::2], held[1::2], strict=True))


def has_regions() -> bool:
    """Whether some table in the file holds only a part of the directions."""
    return any(_REGION in group for group in bpy.data.node_groups)


def note_outside(scene: bpy.types.Scene, lines: list[str]) -> None:
    """Store the warnings about a scene; an empty list if there are none."""
    _noticed[scene.name_full] = lines


def noticed_outside(scene: bpy.types.Scene) -> list[str]:
    """The warnings stored by the last check of the scene."""
    return _noticed.get(scene.name_full, [])
