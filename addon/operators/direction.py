# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses, combs, shows and bakes the direction of a grating on meshes, and unwraps a mesh."""

from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..blender.guard import guarded_draw
from ..blender.session import redraw_views
from ..gratings.direction_source import AXES, AXIS, COMB_SOURCES, FRAME_MAP, KINDS, RADIAL, UV_MAP, DirectionSource
from ..gratings.grating import active_grating
from .shared import Acts, FollowsJob, has_active_mesh, has_grating, has_selected_mesh, in_object_mode

if TYPE_CHECKING:
    from ..workflow.combing import CombJob


class CombGrating(FollowsJob, bpy.types.Operator):
    """Compute a smooth direction on the selected meshes and store it on them. With Direction set to Stored, the scan's
    x axis (left to right) follows it and not the UV map, also when the mesh deforms"""

    bl_idname = "grating.comb"
    bl_label = "Comb Grating"
    then_warns = False
    # Not REGISTER: its panel Adjust Last Operation would comb again at each change and block Blender.
    bl_options = {"UNDO"}

    source: EnumProperty(name="Source", description="What the direction follows", items=COMB_SOURCES)

    @classmethod
    def poll(cls, context):
        return super().poll(context) and in_object_mode(cls, context) and has_selected_mesh(cls, context)

    def start(self, context):
        from ..workflow.combing import start_comb

        job = start_comb(context.scene, context.selected_objects, self.source)
        return job, f"Combing {', '.join(name for name, _ in job.meshes)}"

    def finish(self, job: "CombJob"):
        """Store the comb."""
        from ..workflow.combing import finish_comb

        return finish_comb(job)


class ChooseDirection(Acts, bpy.types.Operator):
    """Choose what the scan's x axis (left to right) follows on the meshes that show the active grating. The material's
    Rotation turns the scan further"""

    bl_idname = "grating.direction"
    bl_label = "Direction Source"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(name="Source", description="What the scan's x axis follows", items=KINDS)
    uv_map: StringProperty(name="UV Map", description="UV map whose U the scan's x axis follows")
    axis: EnumProperty(name="Axis", description="Axis of the object, in its local space", items=AXES, default="Z")
    frame_map: StringProperty(name="Direction Map", description="A picture made by Bake Direction Map")
    angle: StringProperty(
        name="Object Angle",
        description="Name of a custom property, such as grating_angle, that holds an angle in radians. It turns the "
        "scan on each object that has it, so that objects can share one material. Empty: no turn",
    )

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context) and has_grating(cls, context)

    @guarded_draw
    def draw(self, context):
        layout, thing = self.layout, context.object
        layout.prop(self, "kind")
        if self.kind == UV_MAP and thing is not None and thing.type == "MESH":
            layout.prop_search(self, "uv_map", thing.data, "uv_layers", icon="GROUP_UVS")
        elif self.kind == UV_MAP:
            layout.prop(self, "uv_map")
        elif self.kind in (RADIAL, AXIS):
            layout.prop(self, "axis")
        elif self.kind == FRAME_MAP:
            layout.prop_search(self, "frame_map", bpy.data, "images", icon="IMAGE_DATA")
        layout.prop(self, "angle")

    def invoke(self, context, event):
        """Show a dialog with the grating's present values."""
        source = active_grating(context.scene).frame_source()
        self.kind, self.uv_map, self.axis, self.angle = source.kind, source.uv_map, source.axis, source.angle
        self.frame_map = source.frame_map.name if source.frame_map else ""
        return context.window_manager.invoke_props_dialog(self)

    def act(self, context):
        from ..workflow.directing import choose_frame

        image = bpy.data.images.get(self.frame_map)
        source = DirectionSource(self.kind, self.uv_map, self.axis, image, self.angle)
        return [choose_frame(active_grating(context.scene), source)]


class ShowDirection(bpy.types.Operator):
    """Show the direction of the active object's grating: arrows along the scan's x axis (left to right), red lines at
    UV seams where it jumps, and yellow rings where a comb has no direction"""

    bl_idname = "grating.show_direction"
    bl_label = "Show Direction"
    bl_options = {"INTERNAL"}

    # Whether the direction is shown. The panel's button reads this without loading the drawing code.
    on = False
    # The error if drawing failed and the overlay switched itself off.
    fault = ""

    @classmethod
    def poll(cls, context):
        if bpy.app.background:
            cls.poll_message_set("Open Blender with a window: only a 3D view shows the direction")
            return False
        return True

    def execute(self, context):
        set_shown(not ShowDirection.on)
        redraw_views()
        return {"FINISHED"}


def set_shown(on: bool) -> None:
    """Switch the overlay on or off."""
    if on != ShowDirection.on:
        from ..workflow.directing import show

        show(on, _note_fault)
        ShowDirection.on, ShowDirection.fault = on, ""


def _note_fault(line: str) -> None:
    """Record why the overlay switched itself off; the panel shows it."""
    ShowDirection.on, ShowDirection.fault = False, line
    redraw_views()


class BakeDirectionMap(Acts, bpy.types.Operator):
    """Bake the direction of the active mesh's grating into a picture on its active UV map, with Cycles, and make the
    grating read it. For game engines, and to speed up a slow direction source"""

    bl_idname = "grating.bake_direction_map"
    bl_label = "Bake Direction Map"
    bl_options = {"UNDO"}

    uv_map: StringProperty(name="UV Map", description="UV map to bake onto. Empty: the active one")
    size: IntProperty(name="Size", description="Side of the picture, in pixels", default=1024, min=16, max=1 << 14)
    margin: IntProperty(
        name="Margin", description="Bleed past the borders of UV islands, in pixels", default=8, min=2, max=64
    )
    filepath: StringProperty(
        name="File", description="Also save the picture here, as OpenEXR. It is always packed into the .blend",
        subtype="FILE_PATH",
    )  # fmt: skip
    read: BoolProperty(name="Use Picture", description="Make the mesh's gratings use the picture", default=True)

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context) and has_active_mesh(cls, context)

    def act(self, context):
        from ..workflow.combing import bake_direction_map

        path = Path(bpy.path.abspath(self.filepath)) if self.filepath else None
        settings = {"uv_map": self.uv_map, "size": self.size, "margin": self.margin, "path": path, "read": self.read}
        return bake_direction_map(context, context.active_object, **settings)


XATLAS, MINIMUM_STRETCH = "XATLAS", "MINIMUM_STRETCH"


class Unwrap(FollowsJob, bpy.types.Operator):
    """Unwrap the active mesh into a new UV map without overlaps, for textures and direction maps. Its other UV maps
    stay, and its grating keeps its direction"""

    bl_idname = "grating.unwrap"
    bl_label = "Unwrap"
    bl_options = {"UNDO"}

    method: EnumProperty(
        name="Method",
        description="How the islands are cut and flattened",
        items=(
            (XATLAS, "xatlas", "Cuts islands automatically. You can keep working meanwhile"),
            (MINIMUM_STRETCH, "Minimum Stretch", "Blender's own method, along the mesh's seams. Blender waits"),
        ),
    )
    size: IntProperty(
        name="Map Size", description="Side of the textures that will use the map, in pixels", default=1024, min=16,
        max=1 << 15,
    )  # fmt: skip
    padding: IntProperty(
        name="Padding", description="Space between islands, in pixels of Map Size", default=4, min=0, max=256
    )
    density: FloatProperty(
        name="Density", description="Pixels per metre of the surface. 0: as many as fit on the map", default=0.0,
        min=0.0, max=1e9,
    )  # fmt: skip

    @classmethod
    def poll(cls, context):
        return super().poll(context) and in_object_mode(cls, context) and has_active_mesh(cls, context)

    def act(self, context):
        from ..workflow.unwrapping import unwrap_by_blender

        if self.method == MINIMUM_STRETCH:
            return unwrap_by_blender(context, context.active_object, self._packing())
        return super().act(context)

    def invoke(self, context, event):
        return self.execute(context) if self.method == MINIMUM_STRETCH else super().invoke(context, event)

    def start(self, context):
        from ..workflow.unwrapping import Unwrapping

        self._unwrapping = Unwrapping(context.active_object, self._packing())
        return self._unwrapping.job, f"Unwrapping {self._unwrapping.mesh_name}"

    def finish(self, job):
        """Add the new UV map."""
        return self._unwrapping.finish()

    def _packing(self):
        from ...precompute.mesh.unwrap import Packing

        return Packing(self.size, self.padding, self.density)
