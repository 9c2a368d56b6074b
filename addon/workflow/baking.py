# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking a grating in a process beside Blender, and noting the bake."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.surface.steps.pipeline import WARNING
from ..gratings.bakes import asked, note_bake
from ..gratings.grating import Grating, request_record
from ..jobs.child import Deadline, Job
from .making_materials import refresh_group
from .restoring_bakes import bakes_folder

if TYPE_CHECKING:
    from ...precompute.bake.request import BakeRequest


# Hours for each scan of a bake. On two cores 8192 x 8192 pixels are baked and checked in 142 s
# (docs/speed_against_error.md), so the largest scan that a reader takes, of 90 million pixels, in 190 s, and in twice
# that if the bake is refined. A day is 200 times as long, for deep reliefs, slow computers and waits for other bakes.
_LONGEST_HOURS = 24


def start_bake(
    grating: Grating, directory: str = "", *, use_cache: bool = True, request: BakeRequest | None = None
) -> Job:
    """Start a grating's bake, into a folder or, without one, beside the cache's entries. There each request has a
    folder of its own: a bake writes over no other grating's, and over no earlier one, to which undo may lead back. The
    request is the grating's own unless another is given.

    Raises GratingError if what is asked of the bake is not possible."""
    request = request or grating.bake_request()
    folder = Path(bpy.path.abspath(directory)) if directory else bakes_folder(asked(request))
    options = () if use_cache else ("--no-cache",)
    record = json.dumps(request_record(request))

    def words(private: Path) -> list[str]:
        path = private / "request.json"
        path.write_text(record, encoding="utf-8")
        return [*options, "--request", str(path)]

    return Job("bake", words, folder, deadline=deadline_of([scan.source for scan in request.scans], "baked"))


def deadline_of(sources: Sequence[str], done: str) -> Deadline:
    """The deadline of work on some scans, named by their files; `done` is what was not done: "baked"."""
    hours = _LONGEST_HOURS * max(1, len(sources))
    named = ", ".join(dict.fromkeys(Path(source).name for source in sources))
    remedy = "copy the scan to a disk of this computer, or crop it"
    return Deadline(3600.0 * hours, GratingError(named, f"not {done} within {hours} h", remedy))


def finished_bake(
    grating: Grating, directory: str = "", *, use_cache: bool = True, request: BakeRequest | None = None
) -> dict[str, Any]:
    """Start a grating's bake and wait for it; the facts of the run. Raises GratingError if it fails."""
    job = start_bake(grating, directory, use_cache=use_cache, request=request)
    job.wait()
    return job.result()


def bake_and_wait(
    grating: Grating, directory: str = "", *, use_cache: bool = True, request: BakeRequest | None = None
) -> dict[str, Any]:
    """Bake a grating and record it, with the request if one is given; the facts of the run. Raises GratingError if it
    fails."""
    asked_for = request or grating.bake_request()
    facts = finished_bake(grating, directory, use_cache=use_cache, request=asked_for)
    record_bake(grating, facts, asked_for, taken_over=request is not None)
    return facts


def warnings_of(facts: dict[str, Any]) -> list[str]:
    """What the steps of levelling warned of."""
    return [line.removeprefix(WARNING) for line in facts.get("levelling", ()) if line.startswith(WARNING)]


def record_bake(grating: Grating, facts: dict[str, Any], request: BakeRequest, *, taken_over: bool = False) -> None:
    """Record a finished bake of a request in its grating. All materials that show the grating show this bake from now
    on. `taken_over`: another request than the grating's own was baked, which the grating takes over."""
    if taken_over:
        if grating.source:
            grating.take_needs(request.needs)
        else:
            grating.take_request(request)
    grating.for_scene = not request.needs.everything
    summary = [
        f"dE00 {facts['delta_e']['p99']:.2f} (99 %)",
        f"coherence {facts['coherence_um']:.0f} um",
        f"{facts['tiles']} look-ups",
        f"{facts['blender_bytes'] / 2**20:.0f} MiB",
        *(["for this scene alone"] if grating.for_scene else []),
    ]
    note_bake(grating, facts["files"][0], "\n".join(summary), request=request)
    refresh_group(grating)
