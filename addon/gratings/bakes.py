# SPDX-License-Identifier: GPL-3.0-or-later
"""The bakes that this session knows. Undo goes back to a grating as it was before its bake; the bake itself is still
there, and the grating is told so."""

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


# By all that was asked of the bake, as JSON.
_known: dict[str, _Bake] = {}


def note_bake(grating: Grating, path: str, summary: str, *, request: "BakeRequest") -> None:
    """Note a finished bake in its grating, and for a grating from which undo has taken it. `request` is what was asked
    of the bake; the grating may ask for something else by now."""
    grating.bake_path, grating.bake_summary, grating.asked = path, summary, _settings(request)
    _known[asked(request)] = _Bake(path, summary)


def is_asked_otherwise(grating: Grating) -> bool:
    """Whether the grating's settings are no longer those of its bake."""
    if not (grating.asked and grating.source):
        return False
    try:
        return _settings(grating.bake_request()) != grating.asked
    except GratingError:  # its settings are of no bake
        return True


def _settings(request: "BakeRequest") -> str:
    """All that a request asks but the scans' folders, which change when files are moved, as JSON."""
    return json.dumps(request_record(request) | {"scans": request.as_dict()["scans"]}, sort_keys=True)


@persistent
@guarded
def recall_bakes(*_: object) -> None:
    """Called after undo and redo: a grating without a bake takes the bake that it has had with the same settings."""
    for scene in bpy.data.scenes if _known else ():
        gratings: Iterable[Any] = scene.natural_gratings.items if scene.library is None else ()
        for grating in gratings:
            if grating.source and not grating.bake_path:
                _recall(grating)


def asked(request: "BakeRequest") -> str:
    """All that a request asks, as JSON."""
    return json.dumps(request_record(request), sort_keys=True)


def _recall(grating: Grating) -> None:
    with contextlib.suppress(GratingError):  # its settings are of no bake
        bake = _known.get(asked(grating.bake_request()))
        if bake is not None and Path(bake.path).is_file():
            grating.bake_path, grating.bake_summary = bake.path, bake.summary
            grating.asked = _settings(grating.bake_request())
