# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts the active grating's material on meshes, removes it, and repairs and adopts such materials."""

import bpy

from ..gratings.grating import active_grating
from ..materials.group_properties import is_diffraction
from .shared import Acts, OnSelectedMeshes, has_bake, in_object_mode


class AssignToSelected(OnSelectedMeshes, bpy.types.Operator):
    """Put the active grating's material into the active material slot of the selected meshes. The scan's x axis (left
    to right) follows the direction set by Direction"""

    bl_idname = "grating.assign"
    bl_label = "Assign to Selected"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context):
        from ..workflow.assigning import assign_to_meshes

        return assign_to_meshes(context.scene, context.selected_objects)


class AddDiffraction(OnSelectedMeshes, bpy.types.Operator):
    """Add the active grating's diffraction on top of all materials of the selected meshes, in place of any other
    diffraction"""

    bl_idname = "grating.add_diffraction"
    bl_label = "Add to Materials"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context):
        from ..workflow.assigning import add_to_meshes

        return add_to_meshes(context.scene, context.selected_objects)


class RemoveDiffraction(Acts, bpy.types.Operator):
    """Remove diffraction from the selected objects and restore their former materials. Other objects keep it"""

    bl_idname = "grating.remove_diffraction"
    bl_label = "Remove from Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        from ..workflow.assigning import slots_with_diffraction

        if not in_object_mode(cls, context):
            return False
        if not any(slots_with_diffraction(thing) for thing in context.selected_objects):
            cls.poll_message_set("Select a mesh whose material has diffraction")
            return False
        return True

    def act(self, context):
        from ..workflow.assigning import remove_from

        return [remove_from(context.selected_objects)]


class NewDiffractionMaterial(Acts, bpy.types.Operator):
    """Make a new material from the active grating's bake, lit by the scene's lamps. Assign it to a mesh yourself"""

    bl_idname = "grating.new_material"
    bl_label = "New Diffraction Material"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return has_bake(cls, context)

    def act(self, context):
        from ..workflow.making_materials import make_material

        return [f"{make_material(context.scene, active_grating(context.scene)).name}: assign it to a mesh"]


class MendMaterials(Acts, bpy.types.Operator):
    """Rebuild deleted, unpacked or edited pictures and node groups of diffraction materials from their bakes"""

    bl_idname = "grating.mend"
    bl_label = "Mend Materials"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context):
        from ..workflow.adopting import mend_materials

        return mend_materials()


class AdoptMaterials(Acts, bpy.types.Operator):
    """Bring appended and pasted diffraction materials into the list. A copy of a grating in the list follows that
    grating from now on; each other material becomes a separate grating"""

    bl_idname = "grating.adopt"
    bl_label = "Adopt"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        # The panel draws the button only if there is something to adopt. Blender calls this at each redraw.
        if not any(map(is_diffraction, bpy.data.node_groups)):
            cls.poll_message_set("Append or paste a diffraction material first")
            return False
        return True

    def act(self, context):
        from ..workflow.adopting import adopt

        return adopt(context.scene)
