# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import > Height Map, and files that are dropped on a 3D view."""

from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ..blender.guard import guarded
from .last_file import leave, start_where_left
from .reports import report_added


class ImportHeightMap(bpy.types.Operator, ImportHelper):
    """Read a measured height map and add it to the scene's gratings"""

    bl_idname = "grating.import_height_map"
    bl_label = "Import Height Map"
    bl_options = {"REGISTER", "UNDO"}

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
        description="Width of the scan in micrometres. Needed for pictures, which do not store it. 0: the file's own",
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
        from ..workflow.offering_widths import offer_for

        if self.size_um not in (0.0, self.offered_um):
            return False
        offer = offer_for(chosen_files(self))
        before = self.size_um
        self.size_um = self.offered_um = offer.width_um
        self.origin = offer.origin
        return self.size_um != before

    def execute(self, context):
        from ..workflow.offering_widths import import_chosen

        if self.in_dialog:  # Blender does not call check() for a file name that was typed
            self.check(context)
        origin = self.origin if self.size_um == self.offered_um else ""
        given = {"size_um": self.size_um, "height_nm": self.height_nm, "channel": self.channel}
        averaged = self.several == "AVERAGE"
        done = report_added(
            self, lambda: import_chosen(context.scene, chosen_files(self), averaged=averaged, origin=origin, **given)
        )
        if not self.in_dialog:
            return done
        return leave(self, done, **given | {"size_um": 0.0 if origin else self.size_um})


def chosen_files(operator: Any) -> list[str]:
    """The files that were chosen in an operator's dialog or dropped, or the one file that is named."""
    names = [each.name for each in operator.files if each.name]
    # Joined only for several: a single path may be a sample, or set by a script.
    return [str(Path(operator.directory) / name) for name in names] if len(names) > 1 else [operator.filepath]


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


@guarded
def menu_entry(menu, context):
    """Draw the entry in File > Import."""
    menu.layout.operator(ImportHeightMap.bl_idname, text="Height Map (.nid, .spm, .gwy, .png, ...)")
