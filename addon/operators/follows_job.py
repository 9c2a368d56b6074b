# SPDX-License-Identifier: GPL-3.0-or-later
"""The base class of the operators that work in a separate process: progress in the status bar, Esc to cancel."""

from typing import Any, Protocol, cast

from ..blender.guard import guarded_modal
from .polls import OperatorMixin

_POLL_SECONDS = 0.2


class FollowedJob(Protocol):
    """What an operator needs of a job, such as a process."""

    @property
    def running(self) -> bool: ...
    def progress(self) -> tuple[str, float]:
        """What it does, and the share that is done."""
        ...

    def cancel(self) -> None: ...


class FollowsJob(OperatorMixin):
    """An operator that follows a job until it ends. A subclass adds `finish`."""

    # The running job, if any. The panel shows it; disabling the extension stops it.
    job = cast(FollowedJob | None, None)

    @classmethod
    def stop(cls) -> None:
        """Cancel the running job, if any."""
        job, cls.job = cls.job, None
        if job is not None:
            job.cancel()

    def follow(self, context, job: FollowedJob, doing: str) -> set[str]:
        """Make Blender call modal() while the job runs. The status bar shows `doing`."""
        type(self).job, self._doing = job, doing
        self._timer = context.window_manager.event_timer_add(_POLL_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    @guarded_modal
    def modal(self, context, event):
        cls = type(self)
        if event.type == "ESC" or cls.job is None:
            self.cancel(context)
            self.report({"INFO"}, f"{self._doing}: cancelled; nothing was changed")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if cls.job.running:
            stage, fraction = cls.job.progress()
            context.workspace.status_text_set(f"{self._doing}: {stage} {fraction:.0%}   [Esc] cancels")
            redraw_views(context)
            return {"PASS_THROUGH"}
        job, cls.job = cls.job, None
        self._end_modal(context)
        return self.finish(job)

    def finish(self, job: Any) -> set[str]:
        """Use the job that has ended; for subclasses. Returns what execute() returns."""
        raise NotImplementedError

    def cancel(self, context):
        """Stop the job. Blender also calls this when it opens another file or quits."""
        self._end_modal(context)
        self.stop()

    def _end_modal(self, context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)
        redraw_views(context)


def redraw_views(context) -> None:
    """Redraw all 3D views and their panels."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
