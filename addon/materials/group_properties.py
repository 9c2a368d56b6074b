# SPDX-License-Identifier: GPL-3.0-or-later
"""What a Diffraction group notes of itself in custom properties. Saved .blend files hold the names: they must stay."""

import bpy

from ..blender import stored
from ..gratings.direction_source import DirectionSource
from ..gratings.lights_choice import CHOICES, LAMPS_ONLY
from ..gratings.variation import Variation
from ..lamps.find import LAMPS_MAX
from ..lamps.sky import SOURCES_MAX

# The names of two custom properties on a Diffraction group, also in saved files. The first holds for each lamp whether
# light linking keeps it from some object, the second whether shadow rays are traced.
LAMPS, SHADOWS = "ng_keys", "ng_shadows"
# A third holds which lights count. A group without it, of an earlier version, knows lamps alone.
LIGHTS = "ng_lights"
# A fourth holds how many sources of the world there are for it to read.
SOURCES = "ng_sources"
# Two more hold how many of the sources are read, and the bytes of its constants. A group without them, of an earlier
# version, reads all sources and was not counted.
READ, CONSTANTS = "ng_sources_read", "ng_constants"
# A fifth holds where the tangent comes from. A group without it, of an earlier version, knows the default.
FRAME = "ng_frame"
# A sixth holds how the grating varies over the surface.
VARIATION = "ng_variation"
# A seventh holds whether the footprint of a pixel counts. A group without it, of an earlier version, has none.
FOOTPRINT = "ng_footprint"


def is_diffraction(group: bpy.types.NodeTree | None) -> bool:
    """Whether a node group is a Diffraction group."""
    return group is not None and LAMPS in group


def diffraction_groups() -> list[bpy.types.NodeTree]:
    """The file's Diffraction groups, also those that are linked from other files."""
    return [group for group in bpy.data.node_groups if is_diffraction(group)]


def variation_of(group: bpy.types.NodeTree) -> Variation:
    """How a Diffraction group varies over the surface."""
    return Variation.from_property(stored.record(group, VARIATION))


def frame_of(group: bpy.types.NodeTree) -> DirectionSource:
    """Where a Diffraction group takes the tangent from."""
    return DirectionSource.from_property(stored.record(group, FRAME))


def lights_of(group: bpy.types.NodeTree) -> str:
    """Which lights count for a Diffraction group (gratings/lights_choice.py)."""
    return stored.choice(group.get(LIGHTS), CHOICES, LAMPS_ONLY)


def lamps_in(group: bpy.types.NodeTree) -> list[bool]:
    """For each lamp that a Diffraction group reads, at least one, whether it reads the marks of light linking."""
    return stored.flags(group, LAMPS, LAMPS_MAX) or [False]


def traces_shadows(group: bpy.types.NodeTree) -> bool:
    """Whether a Diffraction group traces shadow rays."""
    return stored.flag(group, SHADOWS, True)


def sources_in(group: bpy.types.NodeTree) -> int:
    """How many sources of a world a Diffraction group reads."""
    return stored.count(group, SOURCES, SOURCES_MAX)


def counts_footprint(group: bpy.types.NodeTree) -> bool:
    """Whether a Diffraction group blurs colours that are finer than a pixel."""
    return stored.flag(group, FOOTPRINT)
