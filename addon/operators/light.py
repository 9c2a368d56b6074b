# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds lamps by which a grating shows its colours, chooses the lights that it responds to, and fits light sources to
the scene's world."""

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty, StringProperty

from ..blender.guard import guarded, guarded_draw
from ..gratings.grating import LIGHTS, active_grating
from ..lamps.sky import sky_with_disc
from ..workflow.lights.lighting import add_sun, update_lamps
from .shared import Acts, FollowsJob, has_grating, in_object_mode


class AddSun(Acts, bpy.types.Operator):
    """Add a sun lamp that shines at an angle from above"""

    bl_idname = "grating.add_sun"
    bl_label = "Add Sun"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context):
        sun = add_sun(context.scene)
        update_lamps(context.scene)
        return [f"{sun.name}: lights the scene"]


class AddSkySun(Acts, bpy.types.Operator):
    """Add a sun lamp with the direction, size, colour and strength of the sky's sun, and switch the Sky Texture's Sun
    Disc off. In EEVEE before Blender 5.3 the disc lights only gratings, and the lamp lights everything. Takes some
    seconds"""

    bl_idname = "grating.add_sky_sun"
    bl_label = "Add Sun Lamp for the Sky"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if not in_object_mode(cls, context):
            return False
        if sky_with_disc(context.scene.world) is None:
            cls.poll_message_set("Give the world a Sky Texture with its Sun Disc on first")
            return False
        return True

    def act(self, context):
        from ..workflow.lights.lighting import replace_disc

        return [replace_disc(context.scene)]


class AddDiffractionLamp(Acts, bpy.types.Operator):
    """Add a lamp that throws the spectrum of the active object's grating onto walls and screens, without noise. It
    stands for a square patch of the surface, at the point nearest to the 3D cursor. Cycles only"""

    bl_idname = "grating.add_diffraction_lamp"
    bl_label = "Diffraction Lamp"
    bl_options = {"REGISTER", "UNDO"}

    size_mm: FloatProperty(
        name="Patch Size (mm)",
        description="Side of the square patch, in millimetres. A larger patch sends more light and blurs the spectrum",
        default=10.0,
        min=1e-3,
        max=1e6,
        soft_min=0.1,
        soft_max=100.0,
    )
    lamp: StringProperty(
        name="Lit by", description="Lamp whose light the patch diffracts. Empty: the first lamp in the panel"
    )

    @classmethod
    def poll(cls, context):
        from ..workflow.lights.adding_diffraction_lamps import shows_grating

        if not in_object_mode(cls, context):
            return False
        if not shows_grating(context.active_object):
            cls.poll_message_set("Select a mesh that shows a grating first")
            return False
        return True

    @guarded_draw
    def draw(self, context):
        self.layout.prop(self, "size_mm")
        self.layout.prop_search(self, "lamp", context.scene, "objects", icon="LIGHT")

    def act(self, context):
        from ..workflow.lights.adding_diffraction_lamps import add_diffraction_lamp

        _, lines = add_diffraction_lamp(
            context.scene, context.active_object, context.evaluated_depsgraph_get(),
            near=context.scene.cursor.location, size_m=self.size_mm * 1e-3, lamp_name=self.lamp,
        )  # fmt: skip
        return lines


@guarded
def menu_entry(menu: bpy.types.Menu, _: bpy.types.Context) -> None:
    """Draw the entry in Add > Light."""
    menu.layout.operator(AddDiffractionLamp.bl_idname, icon="LIGHT_AREA")


KINDS = (
    ("SUN", "Sun", "One small sun: crisp, saturated colours"),
    ("STUDIO", "Studio", "A soft box, a weaker one from another side, and a weak fill beside the camera"),
    ("WINDOW", "Window", "One tall soft lamp, and a weak bounce from the other side"),
    ("ORDERS", "Orders", "Up to three wide suns that show colour at the most places, as strong as the colours need"),
    ("GRID", "Softbox with Grid", "A soft spot that lights the object and little of the ground, and a weak fill"),
    ("FLASH", "Flash", "One small lamp beside the camera's lens, on the side that shows the most colour"),
    ("POINTS", "Two Points", "Two small point lamps, for a dark scene"),
)


class AddLightRig(Acts, bpy.types.Operator):
    """Add lamps at the angles that show most colour to the camera, or to this view, and switch the view to Rendered.
    It lights the active object if it has a grating, else all objects with one. A metal in a dim world also gets cards
    to reflect. Pressed again, it replaces its own lamps and keeps all other lamps and the world"""

    bl_idname = "grating.light_rig"
    bl_label = "Light Rig"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(name="Kind", description="The lamps of the rig", items=KINDS)
    seen_from: EnumProperty(
        name="Seen From",
        description="From where the rig looks for colours",
        items=(
            ("CAMERA", "Camera", "The scene's camera; the 3D view if the scene has none"),
            ("VIEW", "This View", "The 3D view as it looks now"),
        ),
        options={"SKIP_SAVE"},
    )
    strength: FloatProperty(
        name="Strength",
        description="Multiplies the strength of all lamps. At 1, a 50 % grey surface that faces the brightest lamp "
        "has a brightness of 0.4",
        default=1.0,
        min=0.0,
        max=1e4,
        soft_max=10.0,
    )
    softness: FloatProperty(
        name="Softness",
        description="Multiplies the size of all lamps. Larger lamps give softer shadows and paler colours",
        default=1.0,
        min=0.01,
        max=10.0,
        soft_min=0.1,
        soft_max=4.0,
    )

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context)

    def invoke(self, context, event):
        """Choose what the artist looks through, and show it rendered."""
        view = _view(context)
        if view is not None and view.view_perspective != "CAMERA":
            self.seen_from = "VIEW"
        done = self.execute(context)
        if view is not None and done == {"FINISHED"}:
            context.space_data.shading.type = "RENDERED"
        return done

    def act(self, context):
        from ..workflow.lights.adding_light_rigs import Rig, add_light_rig, carriers

        scene = context.scene
        return add_light_rig(
            scene, context.evaluated_depsgraph_get(), Rig(self.kind, self.strength, self.softness),
            objects=carriers(scene, context.active_object), view=_view(context), from_view=self.seen_from == "VIEW",
        )  # fmt: skip


def _view(context: bpy.types.Context) -> bpy.types.RegionView3D | None:
    """How the 3D view looks at the scene; None in another editor. A button of the sidebar has no region_data."""
    return getattr(context.space_data, "region_3d", None)


class ChooseLights(Acts, bpy.types.Operator):
    """Choose which lights the materials of the active grating respond to"""

    bl_idname = "grating.lights"
    bl_label = "Lights"
    bl_options = {"REGISTER", "UNDO"}

    lights: EnumProperty(name="Lights", description="Lights that the diffraction responds to", items=LIGHTS)

    @classmethod
    def poll(cls, context):
        return has_grating(cls, context)

    def act(self, context):
        from ..workflow.making_materials import choose_lights

        return choose_lights(active_grating(context.scene), self.lights)


class CountLamp(Acts, bpy.types.Operator):
    """Light the diffraction with this lamp. A lamp that is left out still lights everything else, and costs almost
    nothing. Its white mirror image stays, except with Lamps Only. With All by Samples every lamp counts"""

    bl_idname = "grating.count_lamp"
    bl_label = "Lamp Lights Diffraction"
    bl_options = {"REGISTER", "UNDO"}

    # SKIP_SAVE: from a menu it is the active object, not the lamp of the last call.
    lamp: StringProperty(name="Lamp", description="The lamp's name. Empty: the active object", options={"SKIP_SAVE"})

    def act(self, context):
        from ..workflow.lights.lighting import count_lamp

        return count_lamp(context.scene, self.lamp, context.active_object)


class FitFrames(FollowsJob, bpy.types.Operator):
    """Find the bright parts of an animated world in each frame of the scene's frame range, and key them on the scene.
    They then light the diffraction without noise. Takes some seconds for each frame"""

    bl_idname = "grating.fit_frames"
    bl_label = "Fit Frames"
    bl_options = {"REGISTER", "UNDO"}

    first: IntProperty(name="First", description="First frame. -1: the scene's", default=-1, min=-1)
    last: IntProperty(name="Last", description="Last frame. -1: the scene's", default=-1, min=-1)
    step: IntProperty(
        name="Step", description="Fit every so many frames; the frames between are noisy. 0: the scene's step",
        default=0, min=0,
    )  # fmt: skip

    @classmethod
    def poll(cls, context):
        if context.scene.world is None:
            cls.poll_message_set("Give the scene a world first")
            return False
        return super().poll(context)

    def start(self, context):
        from ..workflow.lights.fitting_frames import FrameFits

        return FrameFits.of_range(context.scene, first=self.first, last=self.last, step=self.step), "Fit Frames"

    def finish(self, job):
        return [job.keep()]


class FitWorld(Acts, bpy.types.Operator):
    """Find the sun, windows and other bright parts of the world. They then light the diffraction without noise"""

    bl_idname = "grating.fit_world"
    bl_label = "Fit World"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        if context.scene.world is None:
            cls.poll_message_set("Give the scene a world first")
            return False
        return True

    def act(self, context):
        """Fit and wait, for scripts."""
        from ..workflow.lights.fitting_worlds import fit_world

        fit_world(context.scene, anew=True)
        return []

    def invoke(self, context, event):
        """Schedule a fit in the background."""
        return self.reported(self._want, context)

    def _want(self, context):
        from ..workflow.lights.fitting_worlds import want_fit

        want_fit(context.scene, anew=True)
        return []
