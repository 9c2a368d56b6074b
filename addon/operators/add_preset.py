# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds a preset, a ready-made surface with its matter and the look of its material: one of the extension's, or an
artist's own file. Shows a preset in a new scene, and returns to the artist's scene."""

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ...precompute.base.failure import GratingError
from .import_files import LoadsFiles, takes_drops
from .shared import Acts, in_object_mode, selected_meshes

# Blender keeps no reference to the texts of a dynamic enumeration, so they are kept here. Read at the first use.
_items: list[tuple[str, str, str]] = []


def presets(operator, context):
    """The presets, each with its title and, as its tooltip, its relief and its matter."""
    if not _items:
        from ...precompute.presets.presets import preset_names

        _items.extend(_item(name) for name in preset_names())
    return _items


def _item(name: str) -> tuple[str, str, str]:
    """An entry of the enumeration. The tooltip of a faulty file is the fault."""
    from ...precompute.presets.presets import read_preset

    try:
        preset = read_preset(name)
    except GratingError as error:
        return name, name, str(error)
    return name, preset.title, f"{preset.request.scans[0].source}; matter: {preset.request.matter}"


class AddPreset(Acts, bpy.types.Operator):
    """Add a ready-made surface to the scene's gratings, with its matter and the look of its material, and put it on the
    selected meshes. It needs no scan, and shows at once at draft quality"""

    bl_idname = "grating.add_preset"
    bl_label = "Add Preset"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(name="Preset", description="Ready-made surface to add", items=presets, options={"SKIP_SAVE"})

    assign: BoolProperty(
        name="Assign", description="Also put it on the selected meshes", default=True, options={"SKIP_SAVE"}
    )

    def act(self, context):
        from ..workflow.presets import import_preset, put_preset

        if self.assign and selected_meshes(context):
            return put_preset(context.scene, self.preset, context.selected_objects)
        return [import_preset(context.scene, self.preset)]


class LoadPreset(LoadsFiles, bpy.types.Operator):  # type: ignore[misc]  # both bases define `check`
    """Add the surface of a preset's file to the scene's gratings, with its matter and the look of its material"""

    bl_idname = "grating.load_preset"
    bl_label = "Load Preset"
    bl_options = {"REGISTER", "UNDO"}

    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def load(self, scene: bpy.types.Scene, path: str) -> list[str]:
        from ..workflow.presets import import_preset

        return [import_preset(scene, path)]


class DropPreset(bpy.types.FileHandler):
    """Add the presets of files that are dropped on a 3D view or a shader editor"""

    bl_idname = "GRATING_FH_preset"
    bl_label = "Grating Preset"
    bl_import_operator = LoadPreset.bl_idname
    bl_file_extensions = ".json"

    @classmethod
    def poll_drop(cls, context):
        """Whether a file may be dropped here."""
        return takes_drops(context)


class ShowMe(Acts, bpy.types.Operator):
    """Show a preset in a new scene with its own lamps, camera and rendered view. Your scene stays as it is"""

    bl_idname = "grating.show_me"
    bl_label = "Show Me"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(name="Preset", description="Ready-made surface to show", items=presets)

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context)

    def act(self, context):
        from ..showcase.show_views import switch_to
        from ..workflow.presets import show_preset

        scene = show_preset(self.preset)
        switch_to(context, scene)
        return [f"{scene.name}: a new scene; your scene is unchanged"]


class BackFromShow(bpy.types.Operator):
    """Return to the scene that was open before Show Me. The show's scene stays in the file"""

    bl_idname = "grating.back_from_show"
    bl_label = "Back to My Scene"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        from ..showcase.show_views import scene_before

        if scene_before(context) is None:
            cls.poll_message_set("Add a scene to return to first")
            return False
        return True

    def execute(self, context):
        from ..showcase.show_views import scene_before, switch_to

        scene = scene_before(context)
        if scene is not None:
            switch_to(context, scene)
        return {"FINISHED"}
