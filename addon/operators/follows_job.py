# SPDX-License-Identifier: GPL-3.0-or-later
"""The base class of the operators that work in a separate process. A bar in the panel and in the status bar shows how
far it is. The cross beside it cancels, or Esc where the work was begun."""

from typing import Any, Protocol, cast

import bpy
from bpy.props import StringProperty

from ..blender.guard import guarded_draw, guarded_modal
from ..gratings.wording import translated
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
        """Make Blender call modal() while the job runs. `doing` names it."""
        type(self).job, self._doing = job, doing
        self._timer = context.window_manager.event_timer_add(_POLL_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    @guarded_modal
    def modal(self, context, event):
        cls = type(self)
        if cls.job is None or _is_meant(context, event):
            self.cancel(context)
            self.report({"INFO"}, f"{self._doing}: cancelled; nothing was changed")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if cls.job.running:
            context.workspace.status_text_set(_draw_status)
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


class CancelJob(bpy.types.Operator):
    """Cancel this work. Nothing is changed. Esc cancels it too, over the area in which it was begun"""

    bl_idname = "grating.cancel"
    bl_label = "Cancel"
    bl_options = {"INTERNAL"}

    follower: StringProperty(name="Operator", description="The operator whose work is cancelled")

    def execute(self, context):
        for follower in followers():
            if follower.bl_idname == self.follower:
                follower.stop()
        return {"FINISHED"}


def followers() -> list[type[FollowsJob]]:
    """The classes of the operators that follow a job."""
    found: list[type[FollowsJob]] = [FollowsJob]
    for each in found:
        found += each.__subclasses__()
    return [each for each in found if hasattr(each, "bl_idname")]


def draw_progress(layout, follower: type[FollowsJob]) -> None:
    """Draw how far an operator's running job is, and the cross that cancels it."""
    if follower.job is None:
        return
    stage, fraction = follower.job.progress()
    row = layout.row(align=True)
    row.progress(factor=fraction, text=translated(stage))
    row.operator(CancelJob.bl_idname, text="", icon="X").follower = follower.bl_idname


@guarded_draw
def _draw_status(header, _context) -> None:
    """Draw the status bar while jobs run."""
    for follower in followers():
        draw_progress(header.layout, follower)


def _is_meant(context, event) -> bool:
    """Whether an event is a press of Esc over the area in which the work was begun. Other areas, the release of a key
    that has cancelled something else, and a playing animation have another use for it."""
    area = context.area
    if (event.type, event.value) != ("ESC", "PRESS") or area is None or context.screen.is_animation_playing:
        return False
    return 0 <= event.mouse_x - area.x < area.width and 0 <= event.mouse_y - area.y < area.height


def redraw_views(context) -> None:
    """Redraw all 3D views and their panels."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
