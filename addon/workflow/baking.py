# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking a grating in a separate process, and recording the bake.

The light of a bake that serves the lamps of a scene.

Giving a preset's grating the draft bake that the extension ships."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.base.files import told_of, write_together
from ...precompute.base.progress import Progress, silent
from ...precompute.colour.channels import light_for
from ...precompute.colour.spaces import lamp_line
from ...precompute.measure.errors import stated_errors
from ...precompute.presets.presets import Preset, draft_request, shipped_draft
from ...precompute.surface.height_map import is_synthetic
from ...precompute.surface.steps.pipeline import WARNING
from ..blender.guard import own_path
from ..blender.working_space import working_space
from ..gratings.bakes import asked, note_bake
from ..gratings.cache_folder import bakes_folder
from ..gratings.grating import Grating, request_record
from ..jobs.child import Deadline, Job
from ..lamps.follow import counted_lamps
from ..lamps.lamp_spectrum import further_spectra, seen_spectrum
from .making_materials import refresh_group

if TYPE_CHECKING:
    from ...precompute.bake.request import BakeRequest


# Time limit in hours for each scan of a bake. On two cores, 8192 x 8192 pixels are baked and checked in 142 s
# (docs/speed_against_error.md). The largest scan that a reader accepts, 90 million pixels, takes 190 s, and twice that
# if the bake is refined. A day is 200 times as long, for deep reliefs, slow computers and waiting for other bakes.
_LONGEST_HOURS = 24
# The dE00 of the colours that a working space lacks, and their share of the light, from which on the panel tells them.
_TOLD_DELTA_E, _TOLD_SHARE = 5.0, 0.1


def start_bake(
    grating: Grating, directory: str = "", *, use_cache: bool = True, request: BakeRequest | None = None
) -> Job:
    """Start a grating's bake into a folder, by default beside the cache's entries. There each request has its own
    folder, so a bake never overwrites another grating's bake or an earlier one that undo may return to. By default the
    request is the grating's own. Raises GratingError if the bake's settings are not possible."""
    request = request or grating.bake_request()
    for scan in request.scans:
        if not is_synthetic(scan.source):
            own_path(scan.source)  # before the bake looks for it in a folder of its own
    folder = own_path(directory) if directory else bakes_folder(asked(request))
    options = () if use_cache else ("--no-cache",)
    record = json.dumps(request_record(request))

    def words(private: Path) -> list[str]:
        path = private / "request.json"
        path.write_text(record, encoding="utf-8")
        return [*options, "--request", str(path)]

    return Job("bake", words, folder, deadline=deadline_of([scan.source for scan in request.scans], "baked"))


def deadline_of(sources: Sequence[str], done: str) -> Deadline:
    """The deadline of work on the scans in some files. `done` is the participle for its message: "baked"."""
    hours = _LONGEST_HOURS * max(1, len(sources))
    named = ", ".join(dict.fromkeys(Path(source).name for source in sources))
    remedy = "copy the scan to a disk of this computer, or crop it"
    return Deadline(3600.0 * hours, GratingError(named, f"not {done} within {hours} h", remedy))


def finished_bake(
    grating: Grating, directory: str = "", *, use_cache: bool = True, request: BakeRequest | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:  # fmt: skip
    """Start a grating's bake, wait for it, and return the facts of the run. Raises GratingError if it fails."""
    job = start_bake(grating, directory, use_cache=use_cache, request=request)
    job.wait(progress)
    return job.result()


def bake_and_wait(
    grating: Grating, directory: str = "", *, use_cache: bool = True, request: BakeRequest | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:  # fmt: skip
    """Bake a grating, record the bake and, if given, its request. Returns the facts. Raises GratingError if it
    fails."""
    asked_for = request or grating.bake_request()
    facts = finished_bake(grating, directory, use_cache=use_cache, request=asked_for, progress=progress)
    record_bake(grating, facts, asked_for, taken_over=request is not None)
    return facts


def warnings_of(facts: dict[str, Any]) -> list[str]:
    """The warnings of the levelling steps."""
    return [line.removeprefix(WARNING) for line in facts.get("levelling", ()) if line.startswith(WARNING)]


def shown_lines(spaces: dict[str, dict[str, float]], space: str) -> list[str]:
    """What a file's working space does to a bake's colours, and the space that would show them better."""
    found = spaces.get(space)
    if found is None or found["p50"] < _TOLD_DELTA_E or found["outside"] < _TOLD_SHARE:
        return []
    lines = ["some of these colours are too pure for the screen; they are shown a little greyer"]
    better = min(spaces, key=lambda space: spaces[space]["p50"] * spaces[space]["outside"])
    if better != space and spaces[better]["p50"] < _TOLD_DELTA_E:
        lines.append(f"the working space {better} holds them better")
    return lines


def record_bake(grating: Grating, facts: dict[str, Any], request: BakeRequest, *, taken_over: bool = False) -> None:
    """Record a finished bake in its grating. All materials that show the grating switch to it. `taken_over`: the
    request was not the grating's own, and the grating adopts it."""
    if taken_over:
        if grating.source:
            grating.take_needs(request.needs)
        else:
            grating.take_request(request)
    grating.for_scene = not request.needs.everything
    summary = [
        *stated_errors(facts["delta_e"]),
        f"coherence {facts['coherence_um']:.0f} um",
        *filter(None, [lamp_line(working_space(), request.illuminant)]),
        *shown_lines(facts.get("shown", {}), working_space()),
        f"{facts['tiles']} look-ups",
        f"{facts['blender_bytes'] / 2**20:.0f} MiB",
        *(["for this scene only"] if grating.for_scene else []),
    ]
    note_bake(grating, facts["files"][0], "\n".join(summary), request=request)
    refresh_group(grating)


def light_of_scene(scene: bpy.types.Scene) -> str:
    """The canonical text of the light that serves the scene's lamps and the sources of its world: `smooth` if all are
    white, because a world's light seldom is. Raises GratingError as light_for does."""
    lamps = {seen_spectrum(lamp.data) for lamp in counted_lamps(scene)} - {""}
    known = further_spectra()
    light = light_for(lamp for lamp in lamps if ":" not in lamp or lamp in known)
    return light_for(["D5500"]) if light == light_for(()) else light


def take_draft(grating: Grating, preset: Preset) -> bool:
    """Set a grating to draft quality, and give it the preset's shipped draft. The files are copied into the cache, as
    another version of the extension may not have them. Returns whether there is a draft. Raises GratingError if the
    cache cannot be written."""
    draft = draft_request(preset.request)
    grating.take_request(draft)
    request = grating.bake_request()
    facts = shipped_draft(preset.name, draft)
    if facts is None:
        return False
    folder = bakes_folder(asked(request))
    with told_of(folder):
        folder.mkdir(parents=True, exist_ok=True)
    copies = {folder / Path(file).name: partial(shutil.copyfile, file) for file in facts["files"]}
    if not all(copy.is_file() for copy in copies):
        write_together(copies)
    record_bake(grating, facts | {"files": [str(copy) for copy in copies]}, request)
    return True
