# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds gratings from bakes that exist already: from the panel's menu, File > Import, or files that are dropped on the
window."""

from functools import partial
from pathlib import Path

import bpy
from bpy.props import CollectionProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ..blender.guard import guarded
from .import_height_map import chosen_files
from .last_file import leave, start_where_left
from .polls import OperatorMixin
from .reports import report_added


class LoadsFiles(ImportHelper, OperatorMixin):  # type: ignore[misc]  # both bases define `check`
    """An operator that adds gratings from files that are chosen in a dialog or dropped, all or none. A subclass adds
    `load`."""

    # SKIP_SAVE: Blender would load the last file again.
    filepath: StringProperty(name="File", subtype="FILE_PATH", options={"HIDDEN", "SKIP_SAVE"})
    # For several files that are chosen or dropped together.
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})

    def load(self, scene: bpy.types.Scene, path: str) -> list[str]:
        """For subclasses: add a file's grating. Returns a line to report. Raises GratingError."""
        raise NotImplementedError

    def invoke(self, context, event):
        if self.properties.is_property_set("filepath") and Path(self.filepath).is_file():  # a dropped file
            return self.execute(context)
        if not self.filepath:
            start_where_left(self)
        return super().invoke(context, event)

    def execute(self, context):
        from ..workflow.importing import all_or_none

        scene = context.scene
        loads = [partial(self.load, scene, bpy.path.abspath(path)) for path in chosen_files(self)]
        return leave(self, report_added(self, lambda: all_or_none(scene, loads)))


class LoadBake(LoadsFiles, bpy.types.Operator):  # type: ignore[misc]  # both bases define `check`
    """Add a grating from a bake that you made before, or that somebody gave you: choose its .exr or its folder"""

    bl_idname = "grating.load_bake"
    bl_label = "Load Bake"
    bl_options = {"REGISTER", "UNDO"}

    filter_glob: StringProperty(default="*.exr", options={"HIDDEN"})

    def load(self, scene: bpy.types.Scene, path: str) -> list[str]:
        from ..workflow.loading_bakes import load_bake

        return load_bake(scene, path)


class DropBake(bpy.types.FileHandler):
    """Load bakes that are dropped on a 3D view or a shader editor. For any .exr, Blender asks whether to load it as a
    bake or as a picture"""

    bl_idname = "GRATING_FH_bake"
    bl_label = "Grating Bake"
    bl_import_operator = LoadBake.bl_idname
    bl_file_extensions = ".exr"

    @classmethod
    def poll_drop(cls, context):
        """Whether a file may be dropped here."""
        return takes_drops(context)


def takes_drops(context: bpy.types.Context) -> bool:
    """Whether files for gratings may be dropped here: on a 3D view or a shader editor."""
    return context.area is not None and context.area.ui_type in ("VIEW_3D", "ShaderNodeTree")


@guarded
def menu_entry(menu, context):
    """Draw the entry in File > Import."""
    menu.layout.operator(LoadBake.bl_idname, text="Grating Bake (.exr)")
