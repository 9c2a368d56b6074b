# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds a snake, or a piece of its shed skin, to the scene."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded
from .shared import in_object_mode, report_failure, report_lines

_SPECIES = (
    ("XENOPELTIS", "Xenopeltis unicolor", "Sunbeam snake: smooth, flush scales, brown with pale rims"),
    ("ELAPHE", "Elaphe guttata", "Corn snake: small keeled scales, red-brown saddles"),
)


class AddSnake(bpy.types.Operator):
    """Add a snake with modelled scales, a skin material, and a UV map along the body. Bake a grating, then use Add to
    Materials to show its diffraction on the skin"""

    bl_idname = "grating.add_snake"
    bl_label = "Snake"
    bl_options = {"REGISTER", "UNDO"}

    species: EnumProperty(name="Species", description="Shape and skin", items=_SPECIES)
    pose: EnumProperty(
        name="Pose",
        description="How the snake lies",
        items=(
            ("RESTING", "Resting", "In loops, with the head on the body"),
            ("COILED", "Coiled", "In a flat coil, with the head in the centre"),
            ("S", "S", "In an S-shaped curve"),
            ("REARING", "Rearing", "With the neck raised"),
            ("CURVE", "Active Curve", "Along the active curve's first spline, as long as the curve, head at its start"),
        ),
    )
    length_m: FloatProperty(
        name="Length (m)",
        description="Length from snout to tail, in metres. Not used with Active Curve",
        default=1.0,
        min=0.01,
        max=100.0,
        soft_min=0.2,
        soft_max=3.0,
    )
    faces: IntProperty(
        name="Faces",
        description="Approximate number of faces of the mesh. Use 200,000 for close-ups. With fewer than 50,000, "
        "scales look faceted. The number of scales adapts to it",
        default=200_000,
        min=11_000,
        max=1_000_000,
    )
    flatness: FloatProperty(
        name="Flat Scales",
        description="How flat each scale is across the body: 0 as round as the body, 1 flat. A flat scale shows one "
        "colour or two, and a round one all colours as thin lines",
        default=0.75,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    seed: IntProperty(name="Seed", description="Varies the slight tilts and shades of the scales", default=0, min=0)
    bones: BoolProperty(name="Bones", description="Add an armature that deforms the snake", default=False)

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context)

    def execute(self, context):
        from ..snakes.shape import Detail
        from ..workflow.adding_snakes import add_snake

        try:
            _, lines = add_snake(
                context, self.species, self.pose,
                length_m=self.length_m, detail=Detail(self.faces, self.flatness, self.seed), bones=self.bones,
            )  # fmt: skip
        except GratingError as error:
            return report_failure(self, error)
        return report_lines(self, lines)


class AddShedSkin(bpy.types.Operator):
    """Add a piece of shed skin: a thin, flat sheet with the scales of a snake's back and sides. Bake a grating, then
    use Add to Materials to show its diffraction on the sheet"""

    bl_idname = "grating.add_shed_skin"
    bl_label = "Shed Skin"
    bl_options = {"REGISTER", "UNDO"}

    species: EnumProperty(name="Species", description="Shape of the scales", items=_SPECIES)
    size_mm: FloatProperty(
        name="Size (mm)", description="Side of the square piece, in millimetres", default=60.0, min=0.1, max=10_000.0
    )
    faces: IntProperty(
        name="Faces", description="Approximate number of faces of the mesh", default=50_000, min=11_000, max=1_000_000
    )
    seed: IntProperty(name="Seed", description="Varies the waves and the tilts of the scales", default=0, min=0)

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context)

    def execute(self, context):
        from ..workflow.adding_snakes import add_shed_skin

        try:
            _, lines = add_shed_skin(
                context, self.species, size_m=self.size_mm * 1e-3, faces=self.faces, seed=self.seed
            )  # fmt: skip
        except GratingError as error:
            return report_failure(self, error)
        return report_lines(self, lines)


@guarded
def menu_entry(menu: bpy.types.Menu, _: bpy.types.Context) -> None:
    """Draw the entries in Add > Mesh."""
    menu.layout.operator(AddSnake.bl_idname, icon="MOD_CURVE")
    menu.layout.operator(AddShedSkin.bl_idname, icon="MOD_CLOTH")
