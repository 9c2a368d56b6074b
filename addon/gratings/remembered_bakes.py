# SPDX-License-Identifier: GPL-3.0-or-later
"""The bakes of this session. Undo removes a bake from its grating; it is given back, as its file still exists."""

import contextlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
from bpy.app.handlers import persistent

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded
from .grating import Grating, request_record

if TYPE_CHECKING:
    from ...precompute.bake.request import BakeRequest


@dataclass(frozen=True)
class _Bake:
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


def is_asked_by_earlier_version(grating: Grating) -> bool:
    """Whether an earlier version of the extension made the grating's bake: a request had fewer settings then."""
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
