# SPDX-License-Identifier: GPL-3.0-or-later
"""The bakes of this session, and the region of directions that each holds. Undo removes a bake from its grating; it is
given back, as its file still exists."""

import contextlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy
from bpy.app.handlers import persistent

from ...precompute.base.failure import GratingError
from ..blender import stored
from ..blender.guard import guarded
from .grating import Grating, request_record

if TYPE_CHECKING:
    from ...precompute.bake.needs import Needs
    from ...precompute.bake.request import BakeRequest
    from ...precompute.table.atlas import Layout


class _Bake(NamedTuple):
    path: str
    summary: str


# Keyed by all settings of the bake, as JSON.
_known: dict[str, _Bake] = {}


def note_bake(grating: Grating, path: str, summary: str, *, request: "BakeRequest") -> None:
    """Store a finished bake in its grating, and remember it in case undo removes it. `request` has the bake's settings,
    which may differ from the grating's by now."""
    grating.bake_path, grating.bake_summary, grating.asked = path, summary, _settings(request)
    _known[asked(request)] = _Bake(path, summary)


def is_asked_otherwise(grating: Grating) -> bool:
    """Whether the grating's settings differ from its bake's."""
    if not (grating.asked and grating.source):
        return False
    try:
        return _settings(grating.bake_request()) != grating.asked
    except GratingError:  # no bake can have its settings
        return True


def is_asked_by_other_version(grating: Grating) -> bool:
    """Whether another version of the extension made the grating's bake: its request has other settings."""
    try:
        before, now = json.loads(grating.asked), json.loads(_settings(grating.bake_request()))
    except (ValueError, GratingError):  # unknown, or damaged
        return False
    return isinstance(before, dict) and before.keys() != now.keys()


def _settings(request: "BakeRequest") -> str:
    """The settings of a request as JSON, without the scans' folders, which change when files are moved."""
    return json.dumps(request_record(request) | {"scans": request.as_dict()["scans"]}, sort_keys=True)


@persistent
@guarded
def recall_bakes(*_: object) -> None:
    """After undo and redo, give gratings without a bake the bake made earlier with the same settings."""
    for scene in bpy.data.scenes if _known else ():
        gratings: Iterable[Any] = scene.natural_gratings.items if scene.library is None else ()
        for grating in gratings:
            if grating.source and not grating.bake_path:
                _recall(grating)


def asked(request: "BakeRequest") -> str:
    """All settings of a request, as JSON."""
    return json.dumps(request_record(request), sort_keys=True)


def _recall(grating: Grating) -> None:
    with contextlib.suppress(GratingError):  # no bake can have its settings
        bake = _known.get(asked(grating.bake_request()))
        if bake is not None and Path(bake.path).is_file():
            grating.bake_path, grating.bake_summary = bake.path, bake.summary
            grating.asked = _settings(grating.bake_request())


# The bounds of u, v and w, each as low, high. A group without this property holds all directions.
_REGION = "ng_region"  # saved in .blend files, so it must not change
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
