# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking a grating in a process beside Blender, and noting the bake."""

import hashlib
from pathlib import Path
from typing import Any

import bpy

from ...precompute.surface.steps.pipeline import WARNING
from ..jobs.child import Job
from ..scene.bakes import asked_of, note_bake
from ..scene.gratings import Grating, cache_folder, request_record
from .material import refresh_group


def start_bake(grating: Grating, directory: str = "", *, use_cache: bool = True) -> Job:
    """Start a grating's bake, into a folder or, without one, beside the cache's entries. There each request has a
    folder of its own: a bake writes over no other grating's, and over no earlier one, to which undo may lead back.

    Raises GratingError if what is asked of the bake is not possible."""
    key = hashlib.sha256(asked_of(grating).encode()).hexdigest()[:16]
    folder = Path(bpy.path.abspath(directory)) if directory else cache_folder() / "bakes" / key
    options = () if use_cache else ("--no-cache",)
    return Job("bake", options, folder, request=request_record(grating.bake_request()))


def bake_and_wait(grating: Grating, directory: str = "", *, use_cache: bool = True) -> dict[str, Any]:
    """Bake a grating and record it; the facts of the run. Raises GratingError if it fails."""
    job = start_bake(grating, directory, use_cache=use_cache)
    job.wait()
    facts = job.result()
    record_bake(grating, facts)
    return facts


def warnings_of(facts: dict[str, Any]) -> list[str]:
    """What the steps of levelling warned of."""
    return [line.removeprefix(WARNING) for line in facts.get("levelling", ()) if line.startswith(WARNING)]


def record_bake(grating: Grating, facts: dict[str, Any]) -> None:
    """Record a finished bake in its grating. All materials that show the grating show this bake from now on."""
    summary = (
        f"dE00 {facts['delta_e']['p99']:.2f} (99 %), coherence {facts['coherence_um']:.0f} um, "
        f"{facts['tiles']} look-ups, {facts['blender_bytes'] / 2**20:.0f} MiB"
    )
    note_bake(grating, facts["files"][0], summary)
    refresh_group(grating)
