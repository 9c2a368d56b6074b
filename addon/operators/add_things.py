# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds things that show a grating: a snake, a piece of its shed skin, and a sticker on the active mesh."""

from math import radians

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..blender.guard import guarded
from .add_preset import presets
from .shared import Acts, has_active_mesh, in_object_mode

ACTIVE = "ACTIVE"
_SPECIES = (
    ("XENOPELTIS", "Xenopeltis unicolor", "Sunbeam snake: smooth, flush scales, brown with pale rims"),
    ("ELAPHE", "Elaphe guttata", "Corn snake: small keeled scales, red-brown saddles"),
)
# Blender keeps no reference to the texts of a dynamic enumeration, so they are kept here. Made at the first use.
_items: list[tuple[str, str, str]] = []


def _surfaces(operator, context):
    """What a sticker can be made of."""
    if not _items:
        tooltip = "The grating that the panel shows; without one, the preset Security Hologram"
        _items.extend(((ACTIVE, "Active Grating", tooltip), *presets(operator, context)))
    return _items


class AddSnake(Acts, bpy.types.Operator):
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
        description="How flat each scale is across the body. At 0, scales are as round as the body, and bands of "
        "colour run along it in thin lines. At 1, each scale is a flat tile of one colour, as in a mosaic",
        default=0.3,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    scatter: FloatProperty(
        name="Scatter",
        description="How far single scales tilt at random, as a multiple of the species' own tilts. At 0, bands of "
        "colour run smoothly over all scales. At 1, they bend a little with each. From 4 on they break up, and single "
        "scales flash",
        default=1.0,
        min=0.0,
        max=20.0,
        soft_max=8.0,
    )
    seed: IntProperty(name="Seed", description="Varies the slight tilts and shades of the scales", default=0, min=0)
    bones: BoolProperty(name="Bones", description="Add an armature that deforms the snake", default=False)

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context)

    def act(self, context):
        from ..snakes.shape import Detail
        from ..workflow.adding_things import add_snake

        _, lines = add_snake(
            context, self.species, self.pose,
            length_m=self.length_m, detail=Detail(self.faces, self.flatness, self.scatter, self.seed), bones=self.bones,
        )  # fmt: skip
        return lines


class AddShedSkin(Acts, bpy.types.Operator):
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

    def act(self, context):
        from ..workflow.adding_things import add_shed_skin

        _, lines = add_shed_skin(context, self.species, size_m=self.size_mm * 1e-3, faces=self.faces, seed=self.seed)
        return lines


class AddSticker(Acts, bpy.types.Operator):
    """Stick a piece of foil with a grating on the active mesh, where you look at it. The mesh keeps its materials. Move
    the sticker with G and scale it with S; it follows the surface"""

    bl_idname = "grating.add_sticker"
    bl_label = "Add Sticker"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(
        name="Surface", description="What the sticker is made of", items=_surfaces, options={"SKIP_SAVE"}
    )
    filepath: StringProperty(
        name="Picture",
        description="Its hue sets the direction of the pattern, and its brightness the strength. The sticker has its "
        "shape. Empty: the pattern of the surface",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_image: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    from_picture: BoolProperty(options={"HIDDEN", "SKIP_SAVE"})
    size: FloatProperty(
        name="Size", description="Width of the sticker over that of the mesh as you see it", default=0.5, min=0.01,
        max=2.0, soft_max=1.0, subtype="FACTOR",
    )  # fmt: skip
    rotation: FloatProperty(
        name="Rotation", description="Turn of the sticker on the surface, counterclockwise", default=0.0,
        min=radians(-360), max=radians(360), subtype="ANGLE",
    )  # fmt: skip

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context) and has_active_mesh(cls, context)

    @classmethod
    def description(cls, context, properties):
        """The tooltip; of the button that asks for a picture, its own."""
        if properties.from_picture:
            return "Choose a picture, and stick a foil with it on the active mesh. Its hues light up one by one"
        return cls.__doc__

    def invoke(self, context, event):
        """Ask for the picture first if the button says so."""
        if self.from_picture and not self.filepath:
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}
        return self.execute(context)

    def act(self, context):
        from ..workflow.adding_things import Sticker, add_sticker

        preset = "" if self.preset == ACTIVE else self.preset
        choice = Sticker(preset, self.filepath, size=self.size, rotation=self.rotation)
        view = getattr(context.space_data, "region_3d", None)
        return add_sticker(context, context.active_object, choice, view=view)


@guarded
def menu_entry(menu: bpy.types.Menu, _: bpy.types.Context) -> None:
    """Draw the entries in Add > Mesh."""
    menu.layout.operator(AddSnake.bl_idname, icon="MOD_CURVE")
    menu.layout.operator(AddShedSkin.bl_idname, icon="MOD_CLOTH")
