# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding presets as gratings of a scene."""

import json

import bpy

from ...precompute.presets.presets import Preset, read_preset
from ..gratings.direction_source import RADIAL, STORED, DirectionSource
from ..gratings.grating import Grating, request_record, unused_name
from .importing import add_averaged, keep_if_new

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
    """Add a preset as add_preset does. If the list has an identical grating already, that one becomes active instead.
    Returns a line for the grating. Raises GratingError as add_preset does."""
    add_preset(scene, name)
    return keep_if_new(scene)


def _take_look(grating: Grating, preset: Preset) -> None:
    """Keep what the grating's material begins with."""
    grating.look.base_color, grating.look.base_roughness = preset.base_color, preset.base_roughness
    grating.look.inputs = json.dumps(dict(preset.inputs), sort_keys=True) if preset.inputs else ""
    grating.look.hologram = json.dumps(preset.hologram.as_dict(), sort_keys=True) if preset.hologram else ""
