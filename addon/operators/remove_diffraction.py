# SPDX-License-Identifier: GPL-3.0-or-later
"""Take diffraction from the materials of the selected meshes."""

import bpy

from ..materials.material import diffraction_nodes, remove_diffraction


class RemoveDiffraction(bpy.types.Operator):
    """Take diffraction from the selected meshes' materials and leave them as they were"""

    bl_idname = "grating.remove_diffraction"
    bl_label = "Remove from Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if not any(diffraction_nodes(m) for m in materials_of(context.selected_objects)):
            cls.poll_message_set("Select a mesh whose material has diffraction")
            return False
        return True

    def execute(self, context):
        changed = [m for m in materials_of(context.selected_objects) if diffraction_nodes(m) and m.library is None]
        for material in changed:
            remove_diffraction(material)
        self.report({"INFO"}, f"removed from {', '.join(material.name for material in changed) or 'none: linked'}")
        return {"FINISHED"}


def materials_of(objects: list[bpy.types.Object]) -> list[bpy.types.Material]:
    """The objects' active materials, each once."""
    return list(dict.fromkeys(o.active_material for o in objects if o.active_material is not None))
