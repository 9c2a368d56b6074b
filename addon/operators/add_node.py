# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds nodes to the material that is open in the shader editor, from its menu Add > Natural Gratings."""

from typing import TYPE_CHECKING

import bpy
from bpy.props import EnumProperty, StringProperty

from ..blender.guard import guarded, guarded_draw
from ..materials.holograms.patterns import NONE, PATTERNS, PICTURE
from .add_preset import presets
from .shared import Acts

if TYPE_CHECKING:
    from ..workflow.presets import Place


class AddsNode(Acts):
    """An operator that adds a node, which then follows the mouse. A subclass adds `put`."""

    def put(self, scene: bpy.types.Scene, place: "Place") -> list[str]:
        """For subclasses: add the node. Returns lines to report. Raises GratingError."""
        raise NotImplementedError

    @classmethod
    def poll(cls, context):
        space = context.space_data
        if not shows_material(space) or space.edit_tree is None:
            cls.poll_message_set("Open a material in the shader editor first")
            return False
        if not space.edit_tree.is_editable:
            cls.poll_message_set("This material or node group is linked from another file. Make it local first")
            return False
        return True

    def invoke(self, context, event):
        space = context.space_data
        if context.region is not None and context.region.type == "WINDOW":
            space.cursor_location_from_region(event.mouse_region_x, event.mouse_region_y)
        else:
            space.cursor_location = space.edit_tree.view_center
        done = self.execute(context)
        if done == {"FINISHED"}:  # as Blender's own Add menu: Esc removes the nodes again
            bpy.ops.node.translate_attach_remove_on_cancel("INVOKE_DEFAULT")
        return done

    def act(self, context):
        from ..workflow.presets import Place

        space = context.space_data
        place = Place(space.id, space.edit_tree, tuple(space.cursor_location))
        return self.put(context.scene, place)


def shows_material(space: bpy.types.Space | None) -> bool:
    """Whether an editor is a shader editor that shows a material."""
    return isinstance(space, bpy.types.SpaceNodeEditor) and isinstance(space.id, bpy.types.Material)


class AddGratingNode(AddsNode, bpy.types.Operator):
    """Add the diffraction of a grating as a node with the look of its material. Link a shader to its Base to keep what
    is below the relief"""

    bl_idname = "grating.add_grating_node"
    bl_label = "Add Grating Node"
    bl_options = {"REGISTER", "UNDO"}

    grating: StringProperty(
        name="Grating", description="Name of the grating. Empty: the active one", options={"SKIP_SAVE"}
    )

    def put(self, scene: bpy.types.Scene, place: "Place") -> list[str]:
        from ..workflow.presets import add_grating_node

        return add_grating_node(scene, self.grating, place)


class AddPresetNode(AddsNode, bpy.types.Operator):
    """Add a ready-made surface to the scene's gratings, and its diffraction as a node"""

    bl_idname = "grating.add_preset_node"
    bl_label = "Add Preset Node"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(name="Preset", description="Ready-made surface to add", items=presets, options={"SKIP_SAVE"})

    def put(self, scene: bpy.types.Scene, place: "Place") -> list[str]:
        from ..workflow.presets import add_preset_node

        return add_preset_node(scene, self.preset, place)


class AddPatternNode(AddsNode, bpy.types.Operator):
    """Add a hologram's pattern as a node. Link its outputs to the inputs of a Diffraction node with the same names"""

    bl_idname = "grating.add_pattern_node"
    bl_label = "Add Hologram Node"
    bl_options = {"REGISTER", "UNDO"}

    pattern: EnumProperty(
        name="Pattern",
        description="How direction and period vary",
        items=[each for each in PATTERNS if each[0] not in (NONE, PICTURE)],
        options={"SKIP_SAVE"},
    )

    def put(self, scene: bpy.types.Scene, place: "Place") -> list[str]:
        from ..workflow.presets import add_pattern_node

        return add_pattern_node(scene, self.pattern, place)


class NodeMenu(bpy.types.Menu):
    """Add a grating, a preset or a hologram's pattern as a node"""

    bl_idname = "GRATING_MT_nodes"
    bl_label = "Natural Gratings"

    @guarded_draw
    def draw(self, context):
        self.layout.operator_context = "INVOKE_REGION_WIN"
        gratings = context.scene.natural_gratings.items
        for grating in gratings:
            self.layout.operator(AddGratingNode.bl_idname, text=grating.name, translate=False).grating = grating.name
        if not gratings:
            self.layout.label(text="No gratings in this scene yet")
        self.layout.separator()
        self.layout.operator_menu_enum(AddPresetNode.bl_idname, "preset", text="Presets")
        self.layout.operator_menu_enum(AddPatternNode.bl_idname, "pattern", text="Holograms")


@guarded
def menu_entry(menu, context):
    """Draw the entry in the shader editor's Add menu, for materials."""
    if shows_material(context.space_data):
        menu.layout.separator()
        menu.layout.menu(NodeMenu.bl_idname)
