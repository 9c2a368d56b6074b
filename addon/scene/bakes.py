# SPDX-License-Identifier: GPL-3.0-or-later
"""The bakes that this session knows. Undo goes back to a grating as it was before its bake; the bake itself is still
there, and the grating is told so."""

import contextlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.app.handlers import persistent

from ...precompute.base.failure import GratingError
from .gratings import Grating, request_record

if TYPE_CHECKING:
    from ...precompute.bake.request import BakeRequest


@dataclass(frozen=True)
class _Bake:
    path: str
    summary: str


# By all that was asked of the bake, as JSON.
_known: dict[str, _Bake] = {}


def note_bake(grating: Grating, path: str, summary: str) -> None:
    """Note a finished bake in its grating, and for a grating from which undo has taken it."""
    grating.bake_path, grating.bake_summary = path, summary
    with contextlib.suppress(GratingError):  # made from a bake alone
        _known[asked(grating.bake_request())] = _Bake(path, summary)


@persistent
def recall_bakes(*_: object) -> None:
    """Called after undo and redo: a grating without a bake takes the bake that it has had with the same settings."""
    for scene in bpy.data.scenes if _known else ():
        for grating in scene.natural_gratings.items if scene.library is None else ():
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
