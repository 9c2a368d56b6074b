# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding presets as gratings of a scene."""

import json

import bpy

from ...precompute.presets.presets import Preset, read_preset
from ..direction.uv_maps import has_uv_map
from ..gratings.direction_source import AXIS, RADIAL, STORED, DirectionSource
from ..gratings.grating import Grating, active_grating, request_record, unused_name
from .assigning import assign_to_meshes
from .baking import bake_and_wait
from .choosing_direction import choose_frame
from .chosen_meshes import meshes_among
from .importing import add_averaged, keep_if_new
from .taking_drafts import take_draft

# The source of the scan's direction for each direction of a preset. A disc's axis is its object's Z axis.
SOURCES = {"stored": DirectionSource(STORED), "radial": DirectionSource(RADIAL, axis="Z")}


def add_preset(scene: bpy.types.Scene, name: str) -> Grating:
    """Add a preset as the scene's active grating. Raises GratingError, with none added, for an unknown name or a faulty
    file."""
    preset = read_preset(name)
    grating = add_averaged(scene, request_record(preset.request)["scans"])
    grating.take_request(preset.request)
    grating.take_frame_source(SOURCES[preset.direction])
    _take_look(grating, preset)
    grating.name = unused_name(preset.title, {each.name for each in scene.natural_gratings.items[:-1]})
    return grating


def import_preset(scene: bpy.types.Scene, name: str) -> str:
    """Add a preset at draft quality, with its shipped draft if there is one. If the list has an identical grating
    already, that one becomes active instead. Returns a line for the grating. Raises GratingError as add_preset does."""
    take_draft(add_preset(scene, name), read_preset(name))
    return keep_if_new(scene)


def put_preset(scene: bpy.types.Scene, name: str, objects: list[bpy.types.Object]) -> list[str]:
    """Add a preset as import_preset does, bake it if no draft ships, and put it on the meshes among the objects. Where
    a mesh has no UV map, the direction follows the objects' Z axis. Returns lines to report. Raises GratingError as
    add_preset and assign_to_meshes do, with nothing added if a mesh cannot carry it."""
    source, lines = SOURCES[read_preset(name).direction], []
    bare = [thing.name for thing in objects if thing.type == "MESH" and not has_uv_map(thing.data, source)]
    if bare:
        source = DirectionSource(AXIS, axis="Z")
        lines = [f"{', '.join(bare)}: no UV map, so the direction follows the object's Z axis; Direction changes it"]
    meshes_among(scene, objects, source)  # first, because it may raise
    line = import_preset(scene, name)
    grating = active_grating(scene)
    if bare:
        choose_frame(grating, source)
    if not grating.bake_path:
        bake_and_wait(grating)
    return [line, *assign_to_meshes(scene, objects), *lines]


def _take_look(grating: Grating, preset: Preset) -> None:
    """Keep what the grating's material begins with."""
    grating.look.base_color, grating.look.base_roughness = preset.base_color, preset.base_roughness
    grating.look.inputs = json.dumps(dict(preset.inputs), sort_keys=True) if preset.inputs else ""
    grating.look.hologram = json.dumps(preset.hologram.as_dict(), sort_keys=True) if preset.hologram else ""
