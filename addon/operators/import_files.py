# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds gratings from files: height maps, and bakes that exist already. They are chosen in File > Import or in the
panel's menu, or dropped on the window. The first file dialog starts at the file that was refused, with all that was
typed, or in the folder of the last one."""

import os
from functools import partial
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ..blender.guard import guarded
from .shared import Acts

# The values of each operator's dialog, by the operator's class.
_left: dict[str, dict[str, Any]] = {}


def start_where_left(operator: bpy.types.Operator) -> None:
    """Set the values of an operator's file dialog. The first one starts in the .blend's folder; without this, it would
    offer the .blend itself."""
    for name, value in _left.get(type(operator).__name__, {"filepath": bpy.path.abspath("//")}).items():
        setattr(operator, name, value)


def leave(operator: Any, done: set[str], **typed: Any) -> set[str]:
    """Keep the folder of an operator's dialog; if the file was refused, the file and what was typed. Returns `done`,
    what the operator's execute() returns."""
    refused = {"filepath": operator.filepath, **typed}
    folder = {"filepath": str(Path(operator.filepath).parent) + os.sep}
    _left[type(operator).__name__] = folder if done == {"FINISHED"} else refused
    return done


def chosen_files(operator: Any) -> list[str]:
    """The files that were chosen in an operator's dialog or dropped, or the one file that is named."""
    names = [each.name for each in operator.files if each.name]
    # Joined only for several: a single path may be a sample, or set by a script.
    return [str(Path(operator.directory) / name) for name in names] if len(names) > 1 else [operator.filepath]


class ImportHeightMap(Acts, bpy.types.Operator, ImportHelper):
    """Read a measured height map and add it to the scene's gratings"""

    bl_idname = "grating.import_height_map"
    bl_label = "Import Height Map"
    bl_options = {"REGISTER", "UNDO"}

    then_warns = False

    filter_glob: StringProperty(options={"HIDDEN"})
    # SKIP_SAVE: values for one file, or for a sample, do not apply to the next file.
    filepath: StringProperty(name="File", subtype="FILE_PATH", options={"HIDDEN", "SKIP_SAVE"})
    # For several files that are chosen or dropped together.
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
    several: EnumProperty(
        name="Several Files",
        description="How to import several files that are chosen together",
        items=(
            ("EACH", "Separate Gratings", "Import each file as a separate grating"),
            ("AVERAGE", "One Grating", "Average scans of one skin, or tiles of one large area, into one grating"),
        ),
        options={"SKIP_SAVE"},
    )
    size_um: FloatProperty(
        name="Width (um)",
        description="Width of the scan in micrometres. Needed for pictures, which do not store it. It replaces "
        "another file's own width. 0: the file's own",
        min=0,
        soft_max=1000,
        options={"SKIP_SAVE"},
    )
    height_nm: FloatProperty(
        name="Height (nm)",
        description="Height from black to white in nanometres. Needed for pictures. 0: the file's own",
        min=0,
        soft_max=10000,
        options={"SKIP_SAVE"},
    )
    # Whether the artist chose the files in the file dialog, the width that it offers, and where that comes from.
    in_dialog: BoolProperty(options={"HIDDEN", "SKIP_SAVE"})
    offered_um: FloatProperty(options={"HIDDEN", "SKIP_SAVE"})
    origin: StringProperty(options={"HIDDEN", "SKIP_SAVE"})
    channel: StringProperty(
        name="Channel", description="Channel of the file. Empty: its topography", options={"SKIP_SAVE"}
    )

    @classmethod
    def description(cls, context, properties):
        """The tooltip, with the readable file types."""
        from ...precompute.surface.height_map import is_synthetic

        if is_synthetic(properties.filepath):
            return "Add this synthetic surface to the scene's gratings. It needs no file and no size"
        from ...precompute.surface.readers.reader_registry import described

        return f"Read a measured height map and add it to the scene's gratings: {described()}"

    def invoke(self, context, event):
        from ...precompute.surface.readers.reader_registry import file_filter

        if self.properties.is_property_set("filepath") and Path(self.filepath).is_file():  # a dropped file
            return self.execute(context) if len(self.files) < 2 else context.window_manager.invoke_props_dialog(self)
        self.filter_glob, self.in_dialog = file_filter(), True
        if not self.filepath:
            start_where_left(self)
        return super().invoke(context, event)

    def check(self, context):
        """Offer a width for the file that was just chosen, unless the artist typed one. Called by the file dialog."""
        from ..workflow.importing import offer_for

        if self.size_um not in (0.0, self.offered_um):
            return False
        offer = offer_for(chosen_files(self))
        before = self.size_um
        self.size_um = self.offered_um = offer.width_um
        self.origin = offer.origin
        return self.size_um != before

    def act(self, context):
        from ..workflow.importing import import_chosen

        if self.in_dialog:  # Blender does not call check() for a file name that was typed
            self.check(context)
        averaged, given = self.several == "AVERAGE", self._given()
        return import_chosen(context.scene, chosen_files(self), averaged=averaged, origin=self._origin(), **given)

    def execute(self, context):
        done = super().execute(context)
        if not self.in_dialog:
            return done
        return leave(self, done, **self._given() | {"size_um": 0.0 if self._origin() else self.size_um})

    def _given(self):
        return {"size_um": self.size_um, "height_nm": self.height_nm, "channel": self.channel}

    def _origin(self):
        """Where the width comes from, unless the artist typed it."""
        return self.origin if self.size_um == self.offered_um else ""


class DropHeightMap(bpy.types.FileHandler):
    """Import microscope files that are dropped on a 3D view"""

    bl_idname = "GRATING_FH_height_map"
    bl_label = "Height Map"
    bl_import_operator = ImportHeightMap.bl_idname
    # As in the readers' registry, which is not loaded when Blender starts.
    bl_file_extensions = (
        ".nid;.gwy;.gsf;.spm;.di;"
        ".000;.001;.002;.003;.004;.005;.006;.007;.008;.009;"
        ".010;.011;.012;.013;.014;.015;.016;.017;.018;.019;"
        ".ibw;.jpk;.jpk-qi-image;.stp;.top;.mi;.mdt;.sxm;.nhf;.h5-jpk;.asd;.sur;.pro;.sdf;.x3p"
    )

    @classmethod
    def poll_drop(cls, context):
        """Whether a file may be dropped here."""
        return context.area is not None and context.area.type == "VIEW_3D"


class LoadsFiles(ImportHelper, Acts):  # type: ignore[misc]  # both bases define `check`
    """An operator that adds gratings from files that are chosen in a dialog or dropped, all or none. A subclass adds
    `load`."""

    then_warns = False

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

    def act(self, context):
        from ..workflow.importing import all_or_none

        scene = context.scene
        return all_or_none(scene, [partial(self.load, scene, bpy.path.abspath(path)) for path in chosen_files(self)])

    def execute(self, context):
        return leave(self, super().execute(context))


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
def menu_entries(menu, context):
    """Draw the entries in File > Import."""
    menu.layout.operator(ImportHeightMap.bl_idname, text="Height Map (.nid, .spm, .gwy, .png, ...)")
    menu.layout.operator(LoadBake.bl_idname, text="Grating Bake (.exr)")
