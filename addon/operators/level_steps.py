# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits the steps that level and repair the active grating's scan: add, remove, move, or all as one text."""

from functools import cache

import bpy
from bpy.props import EnumProperty, StringProperty

from ..gratings.grating import active_grating
from .shared import Acts, has_grating


@cache
def _kinds() -> list[tuple[str, str, str]]:
    """All kinds of steps, for a menu. Cached because Blender does not keep the texts itself."""
    from ...precompute.surface.steps.pipeline import KINDS

    return [(k.name, k.name.capitalize(), f"{k.help[0].upper()}{k.help[1:]}: {k.form}") for k in KINDS.values()]


class _OnSteps(Acts):
    """The base of operators on steps."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return has_grating(cls, context)


class _OnActiveStep(_OnSteps):
    """The base of operators on the active step."""

    @classmethod
    def poll(cls, context):
        if not has_grating(cls, context):
            return False
        grating = context.scene.natural_gratings.active()
        if not 0 <= grating.active_step < len(grating.steps):
            cls.poll_message_set("Add a step first")
            return False
        return True


class AddLevellingStep(_OnSteps, bpy.types.Operator):
    """Add a step that levels or repairs the scan, after the active step"""

    bl_idname = "grating.add_step"
    bl_label = "Add Step"

    kind: EnumProperty(name="Step", description="What the step does", items=lambda self, context: _kinds())

    def act(self, context):
        from ..workflow.levelling import add_step

        add_step(active_grating(context.scene), self.kind)
        return []


class RemoveLevellingStep(_OnActiveStep, bpy.types.Operator):
    """Remove the active step"""

    bl_idname = "grating.remove_step"
    bl_label = "Remove Step"

    def act(self, context):
        grating = active_grating(context.scene)
        grating.steps.remove(grating.active_step)
        grating.active_step = min(grating.active_step, max(len(grating.steps) - 1, 0))
        return []


class MoveLevellingStep(_OnActiveStep, bpy.types.Operator):
    """Move the active step earlier or later in the order"""

    bl_idname = "grating.move_step"
    bl_label = "Move Step"

    direction: EnumProperty(
        name="Direction", items=(("UP", "Up", "One step earlier"), ("DOWN", "Down", "One step later"))
    )

    def act(self, context):
        grating = active_grating(context.scene)
        to = grating.active_step + (-1 if self.direction == "UP" else 1)
        if not 0 <= to < len(grating.steps):
            return {"CANCELLED"}
        grating.steps.move(grating.active_step, to)
        grating.active_step = to
        return []


class LevellingAsText(_OnSteps, bpy.types.Operator):
    """Show all steps as one text, as the command line's --level takes them, to copy or edit"""

    bl_idname = "grating.steps_as_text"
    bl_label = "Steps as Text"

    steps: StringProperty(
        name="Steps", description="Steps in order, such as plane,scars,dust:4. Or: none", options={"SKIP_SAVE"}
    )

    def invoke(self, context, event):
        """Show a dialog with the present steps."""
        self.steps = active_grating(context.scene).levelling
        return context.window_manager.invoke_props_dialog(self, width=400)

    def act(self, context):
        active_grating(context.scene).levelling = self.steps
        return []
