# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import > Height Map, and files that are dropped on a 3D view."""

from pathlib import Path

import bpy
from bpy.props import FloatProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ...precompute.base.failure import GratingError
from .report import report_failure, report_lines


class ImportHeightMap(bpy.types.Operator, ImportHelper):
    """Read a measured height map into the scene's gratings"""

    bl_idname = "grating.import_height_map"
    bl_label = "Import Height Map"
    bl_options = {"REGISTER", "UNDO"}

    filter_glob: StringProperty(options={"HIDDEN"})
    # SKIP_SAVE: what was given for one file, or for a sample, says nothing about the next file.
    filepath: StringProperty(name="File", subtype="FILE_PATH", options={"HIDDEN", "SKIP_SAVE"})
    size_um: FloatProperty(
        name="Width (um)",
        description="Width of the scan in micrometres. Needed for a picture, which does not hold its size",
        min=0,
        soft_max=1000,
        options={"SKIP_SAVE"},
    )
    height_nm: FloatProperty(
        name="Height (nm)",
        description="Height from black to white in nanometres. Needed for a picture",
        min=0,
        soft_max=10000,
        options={"SKIP_SAVE"},
    )
    channel: StringProperty(
        name="Channel", description="The file's channel; empty for its topography", options={"SKIP_SAVE"}
    )

    @classmethod
    def description(cls, context, properties):
        """The tooltip, which names the files that can be read."""
        from ...precompute.surface.readers.registry import described

        return f"Read a measured height map into the scene's gratings: {described()}"

    def invoke(self, context, event):
        from ...precompute.surface.readers.registry import file_filter

        if self.properties.is_property_set("filepath") and Path(self.filepath).is_file():  # it was dropped
            return self.execute(context)
        self.filter_glob = file_filter()
        # The open file's folder. Without it the dialog would offer the .blend itself as the height map.
        self.filepath = self.filepath or bpy.path.abspath("//")
        return super().invoke(context, event)

    def execute(self, context):
        from ..actions.import_height_map import add_grating

        try:
            grating = add_grating(
                context.scene, self.filepath, size_um=self.size_um, height_nm=self.height_nm, channel=self.channel
            )
        except GratingError as error:
            return report_failure(self, error)
        return report_lines(self, [f"{grating.name}: {grating.summary}"])


class DropHeightMap(bpy.types.FileHandler):
    """Imports files of microscopes that are dropped on a 3D view"""

    bl_idname = "GRATING_FH_height_map"
    bl_label = "Height Map"
    bl_import_operator = ImportHeightMap.bl_idname
    # As the readers' registry tells them, which is not loaded at Blender's start.
    bl_file_extensions = (
        ".nid;.gwy;.gsf;.spm;.di;"
        ".000;.001;.002;.003;.004;.005;.006;.007;.008;.009;"
        ".010;.011;.012;.013;.014;.015;.016;.017;.018;.019;"
        ".ibw;.jpk;.jpk-qi-image;.stp;.top;.mi;.sur;.pro;.sdf;.x3p"
    )

    @classmethod
    def poll_drop(cls, context):
        """Whether a file may be dropped here."""
        return context.area is not None and context.area.type == "VIEW_3D"


def menu_entry(menu, context):
    """Draw the entry in File > Import."""
    menu.layout.operator(ImportHeightMap.bl_idname, text="Height Map (.nid, .spm, .gwy, .png, ...)")
