# SPDX-License-Identifier: GPL-3.0-or-later
"""The base class of the operators that bake the active grating. Only one of them runs at a time."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ...precompute.base.failure import GratingError
from ..gratings.grating import unused_name
from ..gratings.wording import in_one_line
from .follows_job import FollowsJob
from .polls import has_grating
from .reports import report_failure, report_lines

if TYPE_CHECKING:
    from ..gratings.grating import Grating
    from ..jobs.child import Job


class FollowsBake(FollowsJob):
    """An operator that follows a bake of a grating. A subclass adds `record`."""

    @classmethod
    def poll(cls, context):
        if running_bake() is not None:
            cls.poll_message_set("Wait until the running bake ends, or cancel it")
            return False
        return has_grating(cls, context)

    def follow_bake(self, context, grating: "Grating", job: "Job") -> set[str]:
        """Let Blender call modal() while a grating's bake runs."""
        # Keep names, because an undo during the bake may free the grating. Two gratings may have the same name, so make
        # this one unique.
        grating.name = unused_name(grating.name, {g.name for g in context.scene.natural_gratings.items if g != grating})
        self._name, self._scene = grating.name, context.scene.name
        return self.follow(context, job, f"Baking {grating.name}")

    def finish(self, job: "Job") -> set[str]:
        """Record the bake."""
        try:
            facts = job.result()
            scene = bpy.data.scenes.get(self._scene)
            grating = scene and scene.natural_gratings.items.get(self._name)
            if not grating:
                file = Path(facts["files"][0]).name
                raise GratingError(
                    self._name, "no longer in the scene", f"its bake {file} is kept, and baking the scan again is quick"
                )
            return self.report_bake(grating, facts)
        except GratingError as error:
            return report_failure(self, error)

    def record(self, grating: "Grating", facts: dict[str, Any]) -> Sequence[str]:
        """Record a finished bake; for subclasses. Returns lines to report. Raises GratingError."""
        raise NotImplementedError

    def report_bake(self, grating: "Grating", facts: dict[str, Any]) -> set[str]:
        """Record a finished bake and report it, as execute() does. Raises GratingError as `record` does."""
        from ..workflow.baking import warnings_of

        more = self.record(grating, facts)
        return report_lines(self, [f"{grating.name}: {in_one_line(grating.bake_summary)}", *warnings_of(facts), *more])


def running_bake() -> type[FollowsBake] | None:
    """The operator whose bake is running."""
    return next((operator for operator in FollowsBake.__subclasses__() if operator.job is not None), None)
