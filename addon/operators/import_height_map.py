# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import > Height Map."""

import bpy
from bpy.props import FloatProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ...precompute import info
from ...precompute.failure import GratingError
from ...precompute.readers import read_height_map
from ..gratings import Grating


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


def add_grating(scene: bpy.types.Scene, source: str, size_um=0.0, height_nm=0.0, channel="") -> Grating:
    """Read a height map and add it to the scene as its active grating; 0 and "" leave it to the file.

    Raises GratingError if it cannot be read."""
    height_map = read_height_map(source, size_um or None, height_nm or None, channel or None)
    facts = info.describe(height_map)
    gratings = scene.natural_gratings
    name = unused_name(height_map.stem, {g.name for g in gratings.items})
    grating = gratings.items.add()
    grating.name = name
    grating.source, grating.summary = source, summary_of(facts)
    grating.size_um, grating.height_nm, grating.channel = size_um, height_nm, channel
    gratings.active_index = len(gratings.items) - 1
    return grating


def unused_name(name: str, taken: set[str]) -> str:
    """The name, numbered as Blender numbers if it is taken: a bake that ends finds its grating by name."""
    candidates = (name, *(f"{name}.{number:03}" for number in range(1, len(taken) + 1)))
    return next(c for c in candidates if c not in taken)


def summary_of(facts: dict) -> str:
    """One line of what `info` found."""
    dy, dx = facts["pixel_size_m"]
    size = f"{facts['cols'] * dx * 1e6:.3g} x {facts['rows'] * dy * 1e6:.3g} um"
    relief = f"relief {facts['height_range_m'] * 1e9:.0f} nm"
    periods = facts["periods_m"]
    # round() and + 0 keep a minus off zero.
    angle = round(facts["period_angles_deg"][0]) + 0 if periods else 0
    period = f", period {periods[0] * 1e9:.0f} nm at {angle} deg" if periods else ""
    return f"{size}, {relief}{period}"


def menu_entry(menu, context):
    """The entry in File > Import."""
    menu.layout.operator(ImportHeightMap.bl_idname, text="Height Map (.nid, .gwy, .png, .tif, .bmp)")
