# SPDX-License-Identifier: GPL-3.0-or-later
"""What the operators share: the conditions of their buttons, and their base classes.

If a condition is not met, the disabled button's tooltip says what is missing."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

import bpy
from bpy.props import StringProperty

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded_draw, guarded_modal
from ..blender.session import redraw_views
from ..gratings.grating import unused_name
from ..gratings.wording import in_one_line, in_words, translated

if TYPE_CHECKING:
    from ..gratings.grating import Grating
    from ..jobs.child import Job


OperatorClass = type[bpy.types.Operator]
# The base of classes that only operators inherit. Only the type checker sees it as an operator, because Blender
# registers the classes that inherit it.
if TYPE_CHECKING:
    OperatorMixin = bpy.types.Operator
else:
    OperatorMixin = object


def in_object_mode(operator: OperatorClass, context: bpy.types.Context) -> bool:
    """Whether Blender is in Object Mode. In Edit Mode a mesh's faces and UV maps cannot be read."""
    if context.mode != "OBJECT":
        operator.poll_message_set("Switch to Object Mode first")
        return False
    return True


def has_grating(operator: OperatorClass, context: bpy.types.Context) -> bool:
    """Whether the scene has an active grating."""
    if context.scene.natural_gratings.active() is None:
        operator.poll_message_set("Add a grating first: import a scan, or choose a preset")
        return False
    return True


def has_bake(operator: OperatorClass, context: bpy.types.Context) -> bool:
    """Whether the active grating is baked."""
    if not has_grating(operator, context):
        return False
    if not context.scene.natural_gratings.active().bake_path:
        operator.poll_message_set("Bake the grating first")
        return False
    return True


def has_active_mesh(operator: OperatorClass, context: bpy.types.Context) -> bool:
    """Whether the active object is a mesh."""
    if context.active_object is None or context.active_object.type != "MESH":
        operator.poll_message_set("Make a mesh the active object first")
        return False
    return True


def selected_meshes(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The meshes among the selected objects."""
    return [thing for thing in context.selected_objects if thing.type == "MESH"]


def has_selected_mesh(operator: OperatorClass, context: bpy.types.Context) -> bool:
    """Whether a mesh is among the selected objects."""
    if not selected_meshes(context):
        from ..workflow.chosen_meshes import no_meshes

        operator.poll_message_set("; ".join(no_meshes(context.selected_objects)) or "Select a mesh first")
        return False
    return True


class Acts(OperatorMixin):
    """An operator that reports what it did, or the error that stopped it, in the words of Blender's interface. A
    subclass adds `act`."""

    # Whether the reported lines after the first are warnings.
    then_warns = True

    def act(self, context) -> Sequence[GratingError | str] | set[str]:
        """For subclasses: do the work. Returns lines to report, or what execute() returns. Raises GratingError."""
        raise NotImplementedError

    def execute(self, context):
        return self.reported(self.act, context)

    def reported(self, act: Callable[..., Sequence[GratingError | str] | set[str]], *given: Any) -> set[str]:
        """Call a function like `act`, and report its lines or its GratingError. Returns what execute() returns."""
        try:
            done = act(*given)
        except GratingError as error:
            self.report({"ERROR"}, in_words(error))
            return {"CANCELLED"}
        if isinstance(done, set):
            return done
        for number, line in enumerate(done):
            self.report({"WARNING"} if number and self.then_warns else {"INFO"}, in_words(line))
        return {"FINISHED"}


class OnSelectedMeshes(Acts):
    """An operator that puts the active grating, which is baked, on the selected meshes."""

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context) and has_bake(cls, context) and has_selected_mesh(cls, context)


_POLL_SECONDS = 0.2


class FollowedJob(Protocol):
    """What an operator needs of a job, such as a process."""

    @property
    def running(self) -> bool: ...
    def progress(self) -> tuple[str, float]:
        """What it does, and the share that is done."""
        ...

    def wait(self) -> None: ...
    def cancel(self) -> None: ...


class FollowsJob(Acts):
    """An operator that follows a job in a separate process until it ends. A bar in the panel and in the status bar
    shows how far it is; the cross beside it cancels, or Esc where the work was begun. Called by a script, it waits for
    the job. A subclass adds `start` and `finish`."""

    # The running job, if any. The panel shows it; disabling the extension stops it.
    job = cast(FollowedJob | None, None)

    @classmethod
    def poll(cls, context):
        if cls.job is not None:
            cls.poll_message_set("Wait until this work ends, or cancel it")
            return False
        return True

    @classmethod
    def stop(cls) -> None:
        """Cancel the running job, if any."""
        job, cls.job = cls.job, None
        if job is not None:
            job.cancel()

    def start(self, context) -> tuple[Any, str] | None:
        """For subclasses: start the job. Returns it and what it does in words, or None if there is nothing to do.
        Raises GratingError."""
        raise NotImplementedError

    def finish(self, job: Any) -> Sequence[GratingError | str]:
        """For subclasses: use the job that has ended. Returns lines to report. Raises GratingError."""
        raise NotImplementedError

    def act(self, context):
        """Do the job and wait, for scripts."""
        if (started := self.start(context)) is None:
            return {"CANCELLED"}
        job, _ = started
        job.wait()
        return self.finish(job)

    def invoke(self, context, event):
        """Start the job; modal() then follows it."""
        return self.reported(self._begin, context)

    def _begin(self, context) -> set[str]:
        started = self.start(context)
        return {"CANCELLED"} if started is None else self.follow(context, *started)

    def follow(self, context, job: FollowedJob, doing: str) -> set[str]:
        """Make Blender call modal() while the job runs. `doing` names it."""
        type(self).job, self._doing = job, doing
        self._timer = context.window_manager.event_timer_add(_POLL_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    @guarded_modal
    def modal(self, context, event):
        cls = type(self)
        if cls.job is None or _is_esc_over_start(context, event):
            self.cancel(context)
            self.report({"INFO"}, f"{self._doing}: cancelled; nothing was changed")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if cls.job.running:
            context.workspace.status_text_set(_draw_status)
            redraw_views()
            return {"PASS_THROUGH"}
        job, cls.job = cls.job, None
        self._end_modal(context)
        return self.reported(self.finish, job)

    def cancel(self, context):
        """Stop the job. Blender also calls this when it opens another file or quits."""
        self._end_modal(context)
        self.stop()

    def _end_modal(self, context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)
        redraw_views()


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


def _is_esc_over_start(context, event) -> bool:
    """Whether an event is a press of Esc over the area in which the work was begun. Other areas, the release of a key
    that has cancelled something else, and a playing animation have another use for it."""
    area = context.area
    if (event.type, event.value) != ("ESC", "PRESS") or area is None or context.screen.is_animation_playing:
        return False
    return 0 <= event.mouse_x - area.x < area.width and 0 <= event.mouse_y - area.y < area.height


class FollowsBake(FollowsJob):
    """An operator that follows a bake of a grating, one at a time. A subclass adds `start` and `record`."""

    @classmethod
    def poll(cls, context):
        if running_bake() is not None:
            cls.poll_message_set("Wait until the running bake ends, or cancel it")
            return False
        return has_grating(cls, context)

    def follow_bake(self, context, grating: "Grating", job: "Job") -> tuple["Job", str]:
        """What `start` returns for a grating's bake."""
        # Keep names, because an undo during the bake may free the grating. Two gratings may have the same name, so make
        # this one unique.
        grating.name = unused_name(grating.name, {g.name for g in context.scene.natural_gratings.items if g != grating})
        self._name, self._scene = grating.name, context.scene.name
        return job, f"Baking {grating.name}"

    def finish(self, job: "Job"):
        """Record the bake."""
        from ..workflow.baking import warnings_of

        facts = job.result()
        scene = bpy.data.scenes.get(self._scene)
        grating = scene and scene.natural_gratings.items.get(self._name)
        if not grating:
            kept = f"its bake {Path(facts['files'][0]).name} is kept, and baking the scan again is quick"
            raise GratingError(self._name, "no longer in the scene", kept)
        more = self.record(grating, facts)
        return [f"{grating.name}: {in_one_line(grating.bake_summary)}", *warnings_of(facts), *more]

    def record(self, grating: "Grating", facts: dict[str, Any]) -> Sequence[str]:
        """For subclasses: record a finished bake. Returns lines to report. Raises GratingError."""
        raise NotImplementedError


def running_bake() -> type[FollowsBake] | None:
    """The operator whose bake is running."""
    bakes = (each for each in followers() if issubclass(each, FollowsBake))
    return next((operator for operator in bakes if operator.job is not None), None)
