# SPDX-License-Identifier: GPL-3.0-or-later
"""Custom properties of a Diffraction group, and the masks that paint its inputs. Saved .blend files contain the names,
so they must not change."""

from math import pi
from typing import Any

import bpy

from ..blender import stored
from ..gratings.direction_source import DirectionSource
from ..gratings.grating import CHOICES, LAMPS_ONLY, Variation
from ..lamps.brightest_lamps import LAMPS_MAX, LEFT_OUT_MAX
from ..lamps.sky import SOURCES_MAX

# LAMPS: for each lamp, whether light linking excludes it for some object. SHADOWS: whether shadow rays are traced.
LAMPS, SHADOWS = "ng_keys", "ng_shadows"
# Which lights are shown.
LIGHTS = "ng_lights"
# The number of lamps that the artist leaves out of a scene.
LEFT_OUT = "ng_left_out"
# For each lamp, whether it is an area lamp in some scene, up to the last that is.
AREAS = "ng_areas"
# For each lamp, whether it may have another spectrum than white in some scene, up to the last that may; and whether a
# source of a world may.
SPECTRA, SOURCE_SPECTRA = "ng_spectra", "ng_source_spectra"
# The number of world sources available to the group.
SOURCES = "ng_sources"
# The number of sources that the group reads, and the bytes of its constants.
READ, CONSTANTS = "ng_sources_read", "ng_constants"
# The number of its nodes, and how many of them look up pictures.
SIZE = "ng_size"
# The source of the tangent.
FRAME = "ng_frame"
# How the grating varies over the surface.
VARIATION = "ng_variation"
# Whether the footprint of a pixel is used.
FOOTPRINT = "ng_footprint"
# Whether each sample answers to every lamp, however many there are.
EVERY_LAMP = "ng_every_lamp"


_SETTINGS = {"shadows": SHADOWS, "lights": LIGHTS, "frame": FRAME, "footprint": FOOTPRINT, "every_lamp": EVERY_LAMP}


def is_diffraction(group: bpy.types.NodeTree | None) -> bool:
    """Whether a node group is a Diffraction group."""
    return group is not None and LAMPS in group


def diffraction_groups() -> list[bpy.types.NodeTree]:
    """The file's Diffraction groups, including linked ones."""
    return [group for group in bpy.data.node_groups if is_diffraction(group)]


def variation_of(group: bpy.types.NodeTree) -> Variation:
    """How a Diffraction group varies over the surface."""
    return Variation.from_property(stored.record(group, VARIATION))


def frame_of(group: bpy.types.NodeTree) -> DirectionSource:
    """The source of a Diffraction group's tangent."""
    return DirectionSource.from_property(stored.record(group, FRAME))


def lights_of(group: bpy.types.NodeTree) -> str:
    """Which lights a Diffraction group shows (gratings/grating.py)."""
    return stored.choice(group.get(LIGHTS), CHOICES, LAMPS_ONLY)


def lamps_in(group: bpy.types.NodeTree) -> list[bool]:
    """For each lamp that a Diffraction group reads (at least one), whether it applies light linking."""
    return stored.flags(group, LAMPS, LAMPS_MAX) or [False]


def left_out_in(group: bpy.types.NodeTree) -> int:
    """The number of left-out lamps of which a Diffraction group shows nothing."""
    return stored.count(group, LEFT_OUT, LEFT_OUT_MAX)


def areas_in(group: bpy.types.NodeTree) -> set[int]:
    """The indices of the lamps that a Diffraction group shows as area lamps, with their shape."""
    return {index for index, is_area in enumerate(stored.flags(group, AREAS, LAMPS_MAX)) if is_area}


def note_areas(group: bpy.types.NodeTree, indices: set[int]) -> None:
    """Set the indices of the lamps that a Diffraction group shows as area lamps."""
    group[AREAS] = [index in indices for index in range(max(indices, default=0) + 1)]


def coloured_in(group: bpy.types.NodeTree) -> set[int]:
    """The indices of the lamps whose spectrum a Diffraction group reads."""
    return {index for index, is_coloured in enumerate(stored.flags(group, SPECTRA, LAMPS_MAX)) if is_coloured}


def note_coloured(group: bpy.types.NodeTree, indices: set[int], *, sources: bool) -> None:
    """Set the indices of the lamps whose spectrum a Diffraction group reads, and whether it reads those of sources."""
    group[SPECTRA] = [index in indices for index in range(max(indices, default=0) + 1)]
    group[SOURCE_SPECTRA] = sources


def reads_source_spectra(group: bpy.types.NodeTree) -> bool:
    """Whether a Diffraction group reads the spectra of world sources."""
    return stored.flag(group, SOURCE_SPECTRA)


def traces_shadows(group: bpy.types.NodeTree) -> bool:
    """Whether a Diffraction group traces shadow rays."""
    return stored.flag(group, SHADOWS, True)


def sources_in(group: bpy.types.NodeTree) -> int:
    """The number of world sources that are available to a Diffraction group."""
    return stored.count(group, SOURCES, SOURCES_MAX)


def counts_footprint(group: bpy.types.NodeTree) -> bool:
    """Whether a Diffraction group blurs colours that are finer than a pixel."""
    return stored.flag(group, FOOTPRINT)


def answers_every_lamp(group: bpy.types.NodeTree) -> bool:
    """Whether each sample of a Diffraction group answers to every lamp, however many there are (lamp_choice.py)."""
    return stored.flag(group, EVERY_LAMP)


def settings_of(group: bpy.types.NodeTree) -> dict[str, Any]:
    """What an artist sets of a Diffraction group beside its sockets: `shadows`, `lights`, `frame`, `footprint`,
    `every_lamp`."""
    return {
        "shadows": traces_shadows(group), "lights": lights_of(group), "frame": frame_of(group),
        "footprint": counts_footprint(group), "every_lamp": answers_every_lamp(group),
    }  # fmt: skip


def note_settings(group: bpy.types.NodeTree, **settings: Any) -> bool:
    """Set some of `settings_of`. Returns whether one of them has changed."""
    now = settings_of(group)
    changed = {name: value for name, value in settings.items() if value != now[name]}
    for name, value in changed.items():
        group[_SETTINGS[name]] = value.as_property() if isinstance(value, DirectionSource) else value
    return bool(changed)


# The inputs that can be painted, each with what black and white stand for. None stands for the input's number.
# A painted input is set by a mask from a colour attribute or a texture, mapped to the input's range.
RANGES: dict[str, tuple[float, float | None]] = {
    "Strength": (0.0, None),
    "Rotation": (-pi / 2, pi / 2),
    "Period Scale": (0.8, 1.25),
}
_LABEL = "Painted"
# How far to the left of the Diffraction node the nodes stand, in node editor units.
_STEP = 220


def paint_of(socket: bpy.types.NodeSocket) -> bpy.types.Node | None:
    """The node that maps the mask which feeds an input, or None if the input is not painted."""
    links = socket.links
    node = links[0].from_node if links else None
    return node if node is not None and node.type == "MAP_RANGE" and node.label == _LABEL else None


def put_paint(socket: bpy.types.NodeSocket, mask: str | bpy.types.Image) -> None:
    """Let a mask set an input of a Diffraction node: a colour attribute by its name, or a texture on the UV map that
    renders. The input keeps its number, which Strength has where the mask is white."""
    tree, node = socket.node.id_data, socket.node
    low, high = RANGES[socket.name]
    if isinstance(mask, str):
        source = tree.nodes.new("ShaderNodeAttribute")
        source.attribute_name = mask
    else:
        source = tree.nodes.new("ShaderNodeTexImage")
        source.image = mask
    spread = tree.nodes.new("ShaderNodeMapRange")
    spread.label = _LABEL
    spread.inputs["To Min"].default_value = low
    spread.inputs["To Max"].default_value = (socket.default_value or 1.0) if high is None else high
    below = list(RANGES).index(socket.name)
    for column, each in enumerate((spread, source), 1):
        each.location = (node.location.x - column * _STEP, node.location.y - below * _STEP)
    tree.links.new(source.outputs["Color"], spread.inputs["Value"])
    tree.links.new(spread.outputs["Result"], socket)


def remove_paint(socket: bpy.types.NodeSocket) -> None:
    """Give a painted input its number back, and remove the nodes. The attribute or the texture stays."""
    spread = paint_of(socket)
    if spread is None:
        return
    tree = spread.id_data
    sources = [link.from_node for link in spread.inputs["Value"].links]
    tree.nodes.remove(spread)
    for source in sources:
        if not any(output.is_linked for output in source.outputs):
            tree.nodes.remove(source)
