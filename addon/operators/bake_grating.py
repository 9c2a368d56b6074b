# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake the active grating, in a process beside Blender."""

from collections.abc import Sequence
from pathlib import Path

import bpy
from bpy.props import StringProperty

from ...precompute.failure import GratingError
from ..bake_job import BakeJob
from ..gratings import Grating, active_grating, cache_folder

_POLL_SECONDS = 0.2


class BakeGrating(bpy.types.Operator):
    """Compute the diffraction table of the active grating and measure its colour error. Esc cancels"""

    bl_idname = "grating.bake"
    bl_label = "Bake Grating"
    bl_options = {"REGISTER"}

    directory: StringProperty(
        name="Folder", description="Where the bake goes; empty for the extension's own cache", subtype="DIR_PATH"
    )

    # The one bake that runs under the interface, if any: shown by the panel, stopped when the extension goes.
    job: BakeJob | None = None

    @classmethod
    def poll(cls, context):
        if BakeGrating.job is not None:
            cls.poll_message_set("A bake is running")
            return False
        if context.scene.natural_gratings.active() is None:
            cls.poll_message_set("Import a height map first")
            return False
        return True

    def execute(self, context):
        """Bake and wait: scripts and batches."""
        try:
            grating = active_grating(context.scene)
            bake_and_wait(grating, self.directory)
        except GratingError as error:
            return self._fail(error)
        self.report({"INFO"}, f"{grating.name}: {grating.bake_summary}")
        return {"FINISHED"}

    def invoke(self, context, event):
        try:
            grating = active_grating(context.scene)
            BakeGrating.job = start_bake(grating, self.directory)
        except GratingError as error:
            return self._fail(error)
        # Names, not the grating itself: an undo during the bake may free it.
        self._name, self._scene = grating.name, context.scene.name
        self._timer = context.window_manager.event_timer_add(_POLL_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        context.window_manager.progress_begin(0, 100)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC" or BakeGrating.job is None:
            self._end_modal(context)
            stop_running_bake()
            self.report({"INFO"}, "Bake cancelled; nothing was changed")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if BakeGrating.job.running:
            stage, fraction = BakeGrating.job.progress()
            context.window_manager.progress_update(fraction * 100)
            context.workspace.status_text_set(f"Baking {self._name}: {stage} {fraction:.0%}   [Esc] cancels")
            _redraw(context)
            return {"PASS_THROUGH"}
        job, BakeGrating.job = BakeGrating.job, None
        self._end_modal(context)
        return self._finish(job)

    def _finish(self, job: BakeJob):
        try:
            facts = job.result()
        except GratingError as error:
            return self._fail(error)
        scene = bpy.data.scenes.get(self._scene)
        grating = scene and scene.natural_gratings.items.get(self._name)
        if not grating:
            return self._fail(f"{self._name}: no longer in the scene; its bake is {facts['files'][0]}")
        record_bake(grating, facts)
        self.report({"INFO"}, f"{grating.name}: {grating.bake_summary}")
        return {"FINISHED"}

    def _fail(self, error: GratingError | str):
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}

    def _end_modal(self, context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)
        _redraw(context)


def start_bake(grating: Grating, directory: str = "", options: Sequence[str] = ()) -> BakeJob:
    """Start a grating's bake, with more options of `bake`; beside the cache's entries unless a folder is given."""
    folder = Path(bpy.path.abspath(directory)) if directory else cache_folder() / "bakes"
    return BakeJob([*bake_arguments(grating), *options], folder)


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


def stop_running_bake() -> None:
    """Cancel the bake that runs, if one does."""
    job, BakeGrating.job = BakeGrating.job, None
    if job is not None:
        job.cancel()


def _redraw(context) -> None:
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
