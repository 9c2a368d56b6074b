# SPDX-License-Identifier: GPL-3.0-or-later
"""Add a snake, or a piece of its shed skin, to the scene."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded
from .polls import in_object_mode
from .reports import report_failure, report_lines

_SPECIES = (
    ("XENOPELTIS", "Xenopeltis unicolor", "Sunbeam snake: smooth, flush plates, brown with pale rims"),
    ("ELAPHE", "Elaphe guttata", "Corn snake: small keeled scales, red-brown saddles"),
)


class AddSnake(bpy.types.Operator):
    """Add a snake whose scales are geometry, with a skin and a UV map along the body. Bake a grating, then use Add to
    Materials to lay its diffraction over the skin"""

    bl_idname = "grating.add_snake"
    bl_label = "Snake"
    bl_options = {"REGISTER", "UNDO"}

    species: EnumProperty(name="Species", description="Shape and skin", items=_SPECIES)
    pose: EnumProperty(
        name="Pose",
        description="How the snake lies",
        items=(
            ("RESTING", "Resting", "In loops, the head laid over the body"),
            ("COILED", "Coiled", "In a flat coil, the head in its middle"),
            ("S", "S", "Winding along"),
            ("REARING", "Rearing", "The neck raised"),
            ("CURVE", "Active Curve", "Along the active curve's first spline, as long as that, its snout at the start"),
        ),
    )
    length_m: FloatProperty(
        name="Length (m)",
        description="From snout to tail, in metres. Along a curve the curve's length counts",
        default=1.0,
        min=0.01,
        max=100.0,
        soft_min=0.2,
        soft_max=3.0,
    )
    faces: IntProperty(
        name="Faces",
        description="About how many faces the mesh has. 200,000 serve close-ups; with fewer than 50,000 scales are "
        "mere facets. The number of scales fits itself to it",
        default=200_000,
        min=11_000,
        max=1_000_000,
    )
    seed: IntProperty(name="Seed", description="Each gives the scales other slight turns and shades", default=0, min=0)
    bones: BoolProperty(name="Bones", description="Bones along the spine that move the mesh", default=False)

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context)

    def execute(self, context):
        from ..workflow.adding_snakes import add_snake

        try:
            _, lines = add_snake(
                context, self.species, self.pose,
                length_m=self.length_m, faces=self.faces, seed=self.seed, bones=self.bones,
            )  # fmt: skip
        except GratingError as error:
            return report_failure(self, error)
        return report_lines(self, lines)


class AddShedSkin(bpy.types.Operator):
    """Add a piece of shed skin: the scales of a snake's back and sides as a thin sheet, laid flat. Bake a grating, then
    use Add to Materials to lay its diffraction over the sheet"""

    bl_idname = "grating.add_shed_skin"
    bl_label = "Shed Skin"
    bl_options = {"REGISTER", "UNDO"}

    species: EnumProperty(name="Species", description="Shape of the scales", items=_SPECIES)
    size_mm: FloatProperty(
        name="Size (mm)", description="Side of the piece, in millimetres", default=60.0, min=0.1, max=10_000.0
    )
    faces: IntProperty(
        name="Faces", description="About how many faces the mesh has", default=50_000, min=11_000, max=1_000_000
    )
    seed: IntProperty(name="Seed", description="Each gives other waves and turns of scales", default=0, min=0)

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
    """The entries of the menu Add > Mesh."""
    menu.layout.operator(AddSnake.bl_idname, icon="MOD_CURVE")
    menu.layout.operator(AddShedSkin.bl_idname, icon="MOD_CLOTH")
