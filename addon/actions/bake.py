# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking a grating in a process beside Blender, and noting the bake."""

from collections.abc import Sequence
from pathlib import Path

import bpy

from ..jobs.child import Job
from ..scene.gratings import Grating, cache_folder


def start_bake(grating: Grating, directory: str = "", options: Sequence[str] = ()) -> Job:
    """Start a grating's bake, with more options of `bake`; beside the cache's entries unless a folder is given."""
    folder = Path(bpy.path.abspath(directory)) if directory else cache_folder() / "bakes"
    return Job([*bake_arguments(grating), *options], folder)


def bake_and_wait(grating: Grating, directory: str = "", options: Sequence[str] = ()) -> dict:
    """Bake a grating and record it; the facts of the run. Raises GratingError if it fails."""
    job = start_bake(grating, directory, options)
    job.wait()
    facts = job.result()
    record_bake(grating, facts)
    return facts


def bake_arguments(grating: Grating) -> list[str]:
    """The command line of `bake` for a grating, without the folder."""
    return [*input_arguments(grating), "--delta-e", f"{grating.delta_e:.6g}"]


def input_arguments(grating: Grating) -> list[str]:
    """Of the command line of `bake` and of `dft`, what says which surface under which coherence."""
    arguments = [grating.source if grating.source.startswith("sample:") else bpy.path.abspath(grating.source)]
    for option, value in (("--size-um", grating.size_um), ("--height-nm", grating.height_nm)):
        if value > 0:
            arguments += [option, f"{value:.9g}"]
    if grating.coherence_um > 0:
        arguments += ["--coherence-um", f"{grating.coherence_um:.6g}"]
    if grating.channel:
        arguments += ["--channel", grating.channel]
    return arguments


def record_bake(grating: Grating, facts: dict) -> None:
    """Note a finished bake; a material of an earlier one is no longer this grating's."""
    grating.bake_path = facts["files"][0]
    grating.material = grating.group = None
    grating.bake_summary = (
        f"dE00 {facts['delta_e']['p99']:.2f} (99 %), coherence {facts['coherence_um']:.0f} um, "
        f"{facts['tiles']} look-ups, {facts['blender_bytes'] / 2**20:.0f} MiB"
    )
