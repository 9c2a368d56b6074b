# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's step Light: the lamps and the world that light the grating; and the panel of a lamp's own spectrum, among
the settings of the lamp."""

import bpy

from ..blender import compat
from ..blender.guard import guarded_draw
from ..gratings.grating import ALL, DAYLIGHT, LAMPS_ONLY, LIGHTS, REST
from ..gratings.wording import in_words, marked, translated
from ..lamps.lamp_spectrum import SHOWN, fault_of
from ..operators.assign import MendMaterials
from ..operators.bake import BakeGrating
from ..operators.light import AddDiffractionLamp, AddSkySun, ChooseLights, CountLamp, FitFrames, FitWorld
from ..operators.shared import draw_progress
from ..workflow.lights.fitting_worlds import is_fitting, last_failure
from .facts import ANIMATED, NOT_FITTED, Facts, LampFact, SceneFacts
from .notes import draw_note

# The largest number of left-out lamps with a row of their own.
_OTHERS_MAX = 8
_ICONS = {"SUN": "LIGHT_SUN", "POINT": "LIGHT_POINT", "SPOT": "LIGHT_SPOT", "AREA": "LIGHT_AREA"}
# How each choice of lights lights the diffraction.
_LIT_BY = {
    LAMPS_ONLY: "Only lamps light the diffraction. The world and Material Preview's studio light have no effect.",
    REST: "Lamps are noise-free. The rest of the world and light from other objects are sampled at random, with noise.",
    ALL: "Every light is sampled at random. Small lamps need many samples.",
}


def draw_light(layout, context, grating, *, facts: Facts) -> None:
    """Draw what lights a grating, and what is wrong with it."""
    scene = facts.scene
    lights = grating.lit_by
    layout.operator(AddDiffractionLamp.bl_idname, icon="LIGHT_AREA")
    chosen = next(label for name, label, _ in LIGHTS if name == lights)
    row = layout.split(factor=0.3)
    row.label(text="Lit by")
    row.operator_menu_enum(ChooseLights.bl_idname, "lights", text=translated(chosen))
    if facts.grating.no_set:
        lights = LAMPS_ONLY
    column = layout.column(align=True)
    for lamp in scene.lamps:
        _draw_lamp(column, context, lamp, counts=True, can_choose=lights != ALL)
    for lamp in scene.others[:_OTHERS_MAX]:
        _draw_lamp(column, context, lamp, counts=lights == ALL, can_choose=lights != ALL)
    if len(scene.others) > _OTHERS_MAX:
        more = translated(
            "and {count} more; select one and use Object > Natural Gratings", count=len(scene.others) - _OTHERS_MAX
        )
        draw_note(column, context, more)
    if lights == REST and scene.world:
        _draw_world(column, context, scene)
    if scene.dark_disc:
        draw_note(column, context, "In EEVEE the sky's sun lights only gratings", icon="INFO")
        column.operator(AddSkySun.bl_idname, icon="LIGHT_SUN")
    if not scene.lamps and lights == LAMPS_ONLY:
        left_out = marked("All lamps are left out, so the diffraction is black")
        none = marked("The scene has no lamp, so the diffraction is black")
        draw_note(column, context, left_out if scene.others else none, icon="INFO")
    for line in (*facts.scene.features, *facts.grating.dull):
        draw_note(column, context, line, icon="INFO")
    for line in facts.grating.far_lamps if lights != ALL else ():
        draw_note(column, context, line, icon="INFO")
        button = column.operator(BakeGrating.bl_idname, text="Bake for These Lamps", icon="RENDER_STILL")
        button.for_lamps = True
    note = layout.column(align=True)
    note.active = False
    draw_note(note, context, _LIT_BY[lights])
    if not compat.HAS_RAYCAST:
        shade = "Before Blender 5.1, objects cast shadows on diffraction only in Cycles with Open Shading Language on."
        draw_note(note, context, shade)


def draw_warnings(layout, context, facts: Facts) -> None:
    """Draw what makes the picture wrong, and the button that mends it. It is drawn although the step is folded."""
    column = layout.column(align=True)
    if facts.grating.no_set:
        draw_note(column, context, facts.grating.no_set, icon="ERROR")
    for line in facts.grating.crowded:
        draw_note(column, context, line, icon="ERROR")
    if facts.scene.instanced:
        names = ", ".join(facts.scene.instanced)
        text = translated("Instanced: {names}; Apply > Make Instances Real", names=names)
        draw_note(column, context, text, icon="ERROR")
    for line in facts.scene.wrong:
        draw_note(column, context, line, icon="ERROR")
    if facts.scene.can_be_mended:
        column.operator(MendMaterials.bl_idname, icon="FILE_REFRESH")


def _draw_lamp(column, context, lamp: LampFact, *, counts: bool, can_choose: bool) -> None:
    """Draw a lamp's name, the button that leaves it out or keeps it in, and its spectrum."""
    row = column.row(align=True)
    if can_choose:
        icon = "CHECKBOX_HLT" if counts else "CHECKBOX_DEHLT"
        row.operator(CountLamp.bl_idname, text="", icon=icon, emboss=False).lamp = lamp.name
    row = row.row()
    row.active = counts and not lamp.hidden
    name = translated("{name} (hidden)", name=lamp.name) if lamp.hidden else lamp.name
    row.label(text=name, icon=_ICONS[lamp.kind], translate=False)
    thing = context.scene.objects.get(lamp.name)
    if counts and can_choose and thing is not None and thing.type == "LIGHT":
        draw_spectrum(row, thing.data)
        draw_fault(column, context, thing.data)


def draw_spectrum(row, light) -> None:
    """Draw the field of a lamp's spectrum."""
    row.prop(light, SHOWN, text="", placeholder=DAYLIGHT)


def draw_fault(column, context, light) -> None:
    """Draw what is wrong with the text in this field."""
    if (fault := fault_of(light)) is not None:
        draw_note(column, context, in_words(fault), icon="ERROR")


def _draw_world(column, context, scene: SceneFacts) -> None:
    """Draw how the scene's world lights the diffraction."""
    text = scene.world
    if is_fitting():
        text = translated("finding its bright spots ...")
    draw_note(column, context, f"{context.scene.world.name}: {translated(text)}", icon="WORLD")
    if FitFrames.job is not None:
        draw_progress(column, FitFrames)
    elif text == ANIMATED:
        column.operator(FitFrames.bl_idname, icon="RENDER_ANIMATION")
    elif scene.has_frames:
        column.operator(FitFrames.bl_idname, text="Fit Frames Again", icon="RENDER_ANIMATION")
    if text == NOT_FITTED:
        if (failure := last_failure(context.scene)) is not None:
            draw_note(column, context, in_words(failure), icon="ERROR")
        column.operator(FitWorld.bl_idname, icon="FILE_REFRESH")


class LampSpectrumPanel(bpy.types.Panel):
    """A lamp's spectrum, which gratings split into colours"""

    bl_idname = "GRATING_PT_lamp_spectrum"
    bl_label = "Diffraction Spectrum"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return getattr(context, "light", None) is not None

    @guarded_draw
    def draw(self, context):
        light = getattr(context, "light", None)
        if light is None:  # Blender draws once more after the last lamp was deleted
            return
        draw_spectrum(self.layout, light)
        draw_fault(self.layout, context, light)
