# SPDX-License-Identifier: GPL-3.0-or-later
"""Says why an artist sees no diffraction colours, with a button for each cause that removes it."""

import textwrap
from typing import Any, ClassVar

import bpy
from bpy.props import EnumProperty

from ...precompute.base.failure import printable
from ..blender.guard import guarded_draw
from .shared import Acts

# At most this many causes are shown; the first ones decide.
_CAUSES_MAX = 4
# Letters in a line. A popup is as wide as its longest line.
_LETTERS = 60
# The actions of workflow/finding_causes.py in the form of Blender's enumerations.
_ACTIONS = (
    ("SHOW_LAMPS", "Show the Lamps", "Show all lamps in renders and 3D views, and give dark ones power and colour"),
    ("BRIGHTEN", "Brighten the Lamps", "Raise the power of lamps that are too weak"),
    ("SHOW_OBJECTS", "Show the Objects", "Show the objects with the grating in renders and 3D views"),
    ("AIM_CAMERA", "Turn the Camera", "Turn the camera to an object with the grating"),
    ("NO_SHADOWS", "Switch Shadows Off", "Let no object cast a shadow on the diffraction"),
    ("RENDERED", "Switch to Rendered", "Show Rendered shading in the 3D view"),
    ("RENDER_PASS", "Show Combined", "Show the render pass Combined in the 3D view"),
    ("SCENE_LIGHTS", "Switch Scene Lights On", "Let the scene's lamps light the 3D view"),
    ("VIEW_LAYER", "Show the Materials", "Show surfaces with their own materials in the view layer"),
    ("CONNECT", "Connect the Diffraction", "Connect the Diffraction nodes to the outputs of their materials"),
    ("GIVE_FACES", "Give the Slot All Faces", "Put all faces into the material slot with the grating"),
    ("STRENGTH", "Reset Strength", "Set the Strength of the Diffraction nodes to 1"),
    ("BASE_BLEND", "Reset Base Blend", "Set the Base Blend of the Diffraction nodes to 0"),
    ("HEIGHT_SCALE", "Reset Height Scale", "Set the Height Scale of the Diffraction nodes to 1"),
    ("ROUGHNESS", "Reset Roughness", "Set the Roughness of the Diffraction nodes to 0"),
    ("PERIOD_SCALE", "Reset Period Scale", "Set the Period Scale of the Diffraction nodes to 1"),
    ("EXPOSURE", "Reset the Exposure", "Set the scene's exposure to 0 and the film's to 1"),
    ("VIEW_TRANSFORM", "Show Purer Colours", "Set the view transform to Khronos PBR Neutral"),
    ("SAMPLES", "Render 256 Samples", "Render at least 256 samples"),
)  # fmt: skip


class WhyBlack(Acts, bpy.types.Operator):
    """Find out why the active grating shows no colours. Each cause has a button that removes it"""

    bl_idname = "grating.why_black"
    bl_label = "Why Is It Black?"

    # What was found when the popup opened.
    found: ClassVar[Any] = None

    def act(self, context):
        """Report the first cause, for scripts."""
        from ..workflow.finding_causes import findings

        return [findings(context).summary]

    def invoke(self, context, event):
        """Find the causes once, and show them."""
        from ..workflow.finding_causes import findings

        WhyBlack.found = findings(context)
        # Unlike a dialog, a menu closes when a button in it is pressed, as its other causes may be outdated then.
        context.window_manager.popup_menu(draw_causes, title=self.bl_label, icon="QUESTION")
        return {"FINISHED"}


class MendCause(Acts, bpy.types.Operator):
    """Remove a cause of missing diffraction colours"""

    bl_idname = "grating.mend_cause"
    bl_label = "Remove Cause"
    bl_options = {"REGISTER", "UNDO"}

    action: EnumProperty(name="Action", description="What removes the cause", items=_ACTIONS)

    @classmethod
    def description(cls, context, properties):
        return next((tooltip for name, _, tooltip in _ACTIONS if name == properties.action), cls.__doc__)

    def act(self, context):
        from ..workflow.finding_causes import mend_cause

        return [mend_cause(context, self.action)]


@guarded_draw
def draw_causes(menu, context) -> None:
    """Draw the causes that were found, each with its button."""
    found, layout = WhyBlack.found, menu.layout.column()
    if not any(cause.sentence == found.summary for cause in found.causes):
        _draw_sentence(layout, found.summary, icon="CHECKMARK")
    for number, cause in enumerate(found.causes[:_CAUSES_MAX]):
        if number:
            layout.separator()
        _draw_sentence(layout, cause.sentence, icon="INFO" if cause.is_warning else "ERROR")
        if cause.button is not None:
            _draw_button(layout, cause.button)


def _draw_sentence(layout, text: str, *, icon: str) -> None:
    """Draw a sentence, wrapped to the popup's width."""
    for line in textwrap.wrap(printable(text), _LETTERS):
        layout.label(text=line, icon=icon)
        icon = "BLANK1"


def _draw_button(layout, button) -> None:
    """Draw the button that removes a cause."""
    row = layout.row()
    row.emboss = "NORMAL"  # a menu's entries do not look like buttons
    # Bakes work in the background only if they are invoked. Other operators would ask for what is given here.
    row.operator_context = "INVOKE_DEFAULT" if button.invoked else "EXEC_DEFAULT"
    pressed = row.operator(button.operator, text=button.text)
    for name, value in button.properties.items():
        setattr(pressed, name, value)
