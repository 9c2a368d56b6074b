# SPDX-License-Identifier: GPL-3.0-or-later
"""The gratings of a scene: what was imported, how it is to be baked, and where its bake lies."""

import os
from pathlib import Path

import bpy
from bpy.props import BoolProperty, CollectionProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ...precompute.bake import cache
from ...precompute.base.failure import GratingError

EXTENSION = __package__.rpartition(".addon.")[0]


class Grating(bpy.types.PropertyGroup):
    """One height map and its bake."""

    source: StringProperty(name="Height Map", description="The scan's file, or sample:NAME for one that ships")
    size_um: FloatProperty(name="Width", description="Width of the scan in micrometres; 0 if the file says", min=0)
    height_nm: FloatProperty(
        name="Height", description="Height from black to white in nanometres; 0 if the file says", min=0
    )
    channel: StringProperty(name="Channel", description="Which of the file's channels; empty for its topography")
    summary: StringProperty(name="Summary", description="Size, relief and strongest period")
    delta_e: FloatProperty(
        name="Colour Error",
        description="Largest colour difference (CIEDE2000, in 99 of 100 directions) of the bake to the exact surface",
        default=1.0,
        min=0.05,
        soft_max=10.0,
    )
    coherence_um: FloatProperty(
        name="Coherence",
        description="Coherence length in micrometres: longer gives sharper colour, and speckle once the scan is too "
        "small to average it. 0 chooses by the scan's size",
        default=0.0,
        min=0.0,
        soft_max=65.0,
    )
    bake_path: StringProperty(name="Bake", description="The baked table", subtype="FILE_PATH")
    bake_summary: StringProperty(name="Bake Summary", description="The bake's measured error and its size")
    shadows: BoolProperty(
        name="Shadows",
        description="Objects shade the diffraction: all in Cycles, those on screen in EEVEE. Before Blender 5.1 "
        "only Cycles with Open Shading Language shades",
        default=True,
    )
    group: PointerProperty(type=bpy.types.ShaderNodeTree, name="Node Group", description="Made from the bake")
    material: PointerProperty(type=bpy.types.Material, name="Material", description="The material made from the bake")

    def baked_file(self) -> Path:
        """The bake's file. Raises GratingError if there is none."""
        if not self.bake_path:
            raise GratingError(f"{self.name}: not baked yet; press Bake Grating first")
        path = Path(bpy.path.abspath(self.bake_path))
        if not path.is_file():
            raise GratingError(f"{self.name}: its bake {path} is gone; press Bake Grating again")
        return path


class SceneGratings(bpy.types.PropertyGroup):
    """All gratings of a scene and which one the panel shows."""

    items: CollectionProperty(type=Grating)
    active_index: IntProperty(name="Active Grating", description="The grating that the buttons work on")

    def active(self) -> Grating | None:
        if 0 <= self.active_index < len(self.items):
            return self.items[self.active_index]
        return None


def active_grating(scene: bpy.types.Scene) -> Grating:
    """The scene's active grating. Raises GratingError if there is none."""
    grating = scene.natural_gratings.active()
    if grating is None:
        raise GratingError(f"scene {scene.name}: no grating in it; import a height map first")
    return grating


def cache_folder() -> Path:
    """Where bakes are kept: $NATURAL_GRATINGS_CACHE, else the folder that Blender gives this extension (whoever writes
    there makes it)."""
    if EXTENSION.startswith("bl_ext.") and not os.environ.get(cache.FOLDER_VARIABLE):
        return Path(bpy.utils.extension_path_user(EXTENSION, path="cache"))
    return cache.default_folder()
