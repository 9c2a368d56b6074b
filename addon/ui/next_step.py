# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of the work, and what to do next."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import bpy

from ..direction.uv_maps import has_uv_map
from ..gratings.direction_source import AXIS
from ..gratings.grating import Grating
from ..gratings.lights_choice import ALL, LAMPS_ONLY
from ..gratings.wording import counted, marked, translated
from ..operators.add_light_rig import AddLightRig
from ..operators.assign import AssignToSelected
from ..operators.bake_grating import BakeGrating
from ..operators.choose_direction import ChooseDirection
from ..operators.polls import selected_meshes
from ..operators.why_black import MendCause
from .facts import Facts

SURFACE, LOOK, LIGHT, QUALITY = marked("Surface"), marked("Look"), marked("Light"), marked("Quality")
# The states of a step.
DONE, NOW, LATER = "done", "now", "later"


@dataclass(frozen=True)
class Next:
    """What to do next: the step that it belongs to, and a button, or a sentence if no button does it."""

    step: str
    sentence: str = ""
    operator: str = ""
    text: str = ""
    icon: str = "NONE"
    properties: Mapping[str, Any] = field(default_factory=dict)


def next_step(context: bpy.types.Context, grating: Grating, facts: Facts) -> Next | None:
    """What to do next with the active grating; None if it is baked, on an object, lit and shown."""
    if not grating.bake_path:
        return Next(SURFACE, operator=BakeGrating.bl_idname, text="Bake", icon="RENDER_STILL")
    if facts.grating.outdated and not grating.source:
        return Next(SURFACE, f"{facts.grating.outdated}. Load it again, or import the height map")
    if facts.grating.outdated:
        step = QUALITY if facts.grating.shown_on else SURFACE  # what is shown stays done
        return Next(step, facts.grating.outdated, BakeGrating.bl_idname, text="Bake Again", icon="RENDER_STILL")
    if not facts.grating.shown_on:
        chosen = selected_meshes(context)
        if not chosen:
            return Next(LOOK, "Select a mesh in the 3D view. It will show the grating")
        source = grating.frame_source()
        bare = [thing.name for thing in chosen if not has_uv_map(thing.data, source)]
        if bare:
            sentence = translated("{names}: no UV map that gives a direction", names=", ".join(bare))
            return Next(
                LOOK, sentence, ChooseDirection.bl_idname,
                text="Use the Object's Z Axis", icon="ORIENTATION_LOCAL", properties={"kind": AXIS, "axis": "Z"},
            )  # fmt: skip
        text = counted("Assign to {name}", "Assign to {count} Meshes", len(chosen), name=chosen[0].name)
        return Next(LOOK, operator=AssignToSelected.bl_idname, text=text, icon="BRUSH_DATA")
    if not is_lit(grating, facts):
        return Next(
            LIGHT, "Nothing lights the grating", AddLightRig.bl_idname, text="Add a Light Rig", icon="LIGHT_SUN"
        )
    view = context.space_data
    if isinstance(view, bpy.types.SpaceView3D) and view.shading.type != "RENDERED":
        return Next(
            LIGHT, operator=MendCause.bl_idname, text="Switch to Rendered", icon="SHADING_RENDERED",
            properties={"action": "RENDERED"},
        )  # fmt: skip
    return None


def is_lit(grating: Grating, facts: Facts) -> bool:
    """Whether a lamp, or the world where it counts, lights the grating."""
    lamps = (*facts.scene.lamps, *(facts.scene.others if grating.lit_by == ALL else ()))
    return any(not lamp.hidden for lamp in lamps) or (grating.lit_by != LAMPS_ONLY and bool(facts.scene.world))


def state_of(step: str, following: Next | None) -> str:
    """The state of a step, given what to do next. Quality has no end, so it is never done."""
    order = (SURFACE, LOOK, LIGHT, QUALITY)
    if step == QUALITY:
        return LATER
    if following is None or order.index(step) < order.index(following.step):
        return DONE
    return NOW if step == following.step else LATER
