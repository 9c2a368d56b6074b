# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import > Height Map."""

import bpy
from bpy.props import FloatProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ...precompute.base.failure import GratingError
from ..actions.import_height_map import add_grating


class ImportHeightMap(bpy.types.Operator, ImportHelper):
    """Read an AFM height map (Nanosurf .nid, Gwyddion .gwy, or a grey PNG, TIFF or BMP) into the scene's gratings"""

    bl_idname = "grating.import_height_map"
    bl_label = "Import Height Map"
    bl_options = {"REGISTER", "UNDO"}

    filter_glob: StringProperty(default="*.nid;*.gwy;*.png;*.tif;*.tiff;*.bmp", options={"HIDDEN"})
    size_um: FloatProperty(
        name="Width (um)",
        description="Width of the scan in micrometres. A picture does not know its size: needed for PNG, TIFF and BMP",
        min=0,
        soft_max=1000,
    )
    height_nm: FloatProperty(
        name="Height (nm)",
        description="Height from black to white in nanometres. Needed for PNG, TIFF and BMP",
        min=0,
        soft_max=10000,
    )
    channel: StringProperty(name="Channel", description="Which of the file's channels; empty for its topography")

    def execute(self, context):
        try:
            grating = add_grating(context.scene, self.filepath, self.size_um, self.height_nm, self.channel)
        except GratingError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{grating.name}: {grating.summary}")
        return {"FINISHED"}


def menu_entry(menu, context):
    """The entry in File > Import."""
    menu.layout.operator(ImportHeightMap.bl_idname, text="Height Map (.nid, .gwy, .png, .tif, .bmp)")
