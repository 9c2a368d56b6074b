# SPDX-License-Identifier: GPL-3.0-or-later
"""Draft bakes of the presets. The package ships them, so that a preset can be shown without a bake.

A draft has its own folder, which holds the bake's files and draft.json: the version and the request of the bake, and
its facts as `bake --json` prints them, without time and memory. So two drafts made on the same kind of processor are
the same bytes."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..bake.cache import BAKE_VERSION
from ..bake.request import BakeRequest
from ..base.failure import GratingError
from ..base.files import write_whole
from ..base.strict_json import read_json

FOLDER = Path(__file__).parents[2] / "drafts"
# The settings of a draft. Its colours are softer than those of a full bake, and its files are a few megabytes.
DELTA_E, COHERENCE_M = 3.0, 10e-6
_RECORD = "draft.json"
# The number of the record's format.
_FORMAT = 2
# Facts of a run, which differ from one run to the next.
_OF_THE_RUN = ("seconds", "check_seconds", "peak_bytes", "cached")


def draft_request(request: BakeRequest) -> BakeRequest:
    """The request for a draft of the same surface."""
    return replace(request, delta_e=DELTA_E, coherence_length_m=COHERENCE_M)


def shipped_draft(name: str, request: BakeRequest, folder: Path = FOLDER) -> dict[str, Any] | None:
    """The facts of a preset's shipped draft, with the paths of its files. `request` is the draft's request. Returns
    None if there is no draft, or if it was made by another version or from another request."""
    home = folder / name
    try:
        record = read_json(home / _RECORD, "build the package again")
        facts = dict(record["facts"])
        files = [home / str(file) for file in facts["files"]]
        current = (record["format"], record["version"], record["request"]) == (_FORMAT, *_made_by(request))
    except (GratingError, KeyError, TypeError, ValueError):
        return None
    if not (current and files and all(file.is_file() for file in files)):
        return None
    return facts | {"files": [str(file) for file in files]}


def write_draft(
    name: str, request: BakeRequest, bake: Callable[[Path], Mapping[str, Any]], *, folder: Path = FOLDER
) -> Path:
    """Make a preset's draft. `bake` bakes into the folder that it is given, and returns the bake's facts. Returns the
    draft's folder. Raises GratingError if the draft cannot be written, or as `bake` does."""
    home = folder / name
    facts = {name: value for name, value in bake(home).items() if name not in _OF_THE_RUN}
    facts["files"] = [Path(file).name for file in facts["files"]]
    version, asked = _made_by(request)
    record = {"format": _FORMAT, "version": version, "request": asked, "facts": facts}
    write_whole(home / _RECORD, lambda path: path.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8"))
    return home


def _made_by(request: BakeRequest) -> tuple[int, Any]:
    """The version of bakes, and a request as it is read from JSON."""
    return BAKE_VERSION, json.loads(json.dumps(request.as_dict()))
