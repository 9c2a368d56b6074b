# SPDX-License-Identifier: GPL-3.0-or-later
"""The Diffraction node group: a base, and over it a coat that diffracts the light of every lamp.

| socket            | symbol | default | meaning |
|-------------------|--------|---------|---------|
| Base              |        | black   | the shader under the relief: the material as it was without diffraction |
| Base Blend        | wd     | 0       | 0 is a physical coat; the thesis's texture blending (Algorithm 4) uses 0.1 |
| Normal, Tangent   | N, T   | surface's, source's | normal and direction of the scan's x axis; only for links |
| Strength          | s      | 1       | scales the diffraction; 1 is physically correct |
| Rotation          |        | 0       | radians; turns the scan about the normal, from T towards B |
| Roughness, IOR, Period Scale, Height Scale | | | passed on to the response (response.py) |
| Shader (out)      |        |         | the material |
| Diffraction (out) |        |         | its diffracted radiance alone, also an AOV of that name |

Which lights are shown is one of gratings/grating.py:

| LAMPS | the followed lamps by Lo alone; no closures, no noise |
| REST  | the followed lamps and the sources of the world (lamps/sky.py) by Lo, without their mirror images; one closure
          for the mirror images of everything, and one for the scattered light of everything else |
| ALL   | closures for the mirror images and the scattered light of everything; no Lo |

EEVEE holds at most 64 KiB of a material's constants (nodes/interface.py). Sources that do not fit, the dimmest
first, are left to the closures, in Cycles too.

skin_nodes.py makes the nodes. All scenes of a file share a Diffraction group, so it has nodes for the lights of all."""

import math
from collections.abc import Iterable
from itertools import zip_longest
from typing import Any

import bpy

from ..blender import stored
from ..gratings.grating import LAMPS_ONLY, REST, Variation
from ..gratings.wording import translated
from ..lamps.follow import coloured_lamps, followed_lamps, lamp_count, left_out_count
from ..lamps.light_linking import is_linked
from ..lamps.sky import coloured_sources, source_count
from ..nodes.interface import (
    GROUP_WIDTH,
    ROOM,
    Socket,
    add_interface,
    has_parts,
    has_sockets,
    note_parts,
    restore_interface,
    size_of,
)
from . import group_properties
from .group_properties import (
    areas_in,
    coloured_in,
    diffraction_groups,
    is_diffraction,
    lamps_in,
    left_out_in,
    lights_of,
    note_areas,
    note_coloured,
    note_settings,
    reads_source_spectra,
    sources_in,
    traces_shadows,
    variation_of,
)
from .response import (
    HEIGHT_SCALE,
    IOR,
    PERIOD_SCALE,
    ROUGHNESS,
    Response,
    further_responses,
    layered_in,
    response_in,
    responses_in,
)
from .shadow import is_of_other_version


def lamps_of_file() -> list[bool]:
    """For each lamp that some scene of the file follows, whether its light is linked. Never empty."""
    followed = [[is_linked(lamp) for lamp in followed_lamps(scene)] for scene in bpy.data.scenes]
    return [any(linked) for linked in zip_longest([False], *followed, fillvalue=False)]


def areas_of_file() -> set[int]:
    """The indices of the lamps that are area lamps in some scene of the file."""
    lamps = (pair for scene in bpy.data.scenes for pair in enumerate(followed_lamps(scene)))
    return {index for index, lamp in lamps if lamp.data.type == "AREA"}


def coloured_of_file() -> set[int]:
    """The indices of the lamps that may have another spectrum than white in some scene of the file."""
    return set().union(*map(coloured_lamps, bpy.data.scenes))


def has_coloured_sources() -> bool:
    """Whether a source of a world in the file has another spectrum than white."""
    return any(map(coloured_sources, bpy.data.scenes))


def left_out_of_file() -> int:
    """The largest number of lamps that the artist leaves out of a scene of the file."""
    return max(map(left_out_count, bpy.data.scenes), default=0)


def sources_of_file() -> int:
    """The largest number of world sources that a scene of the file stores."""
    return max(map(source_count, bpy.data.scenes), default=0)


def follows_light_linking() -> bool:
    """Whether some Diffraction group in the file applies light linking."""
    return any(any(lamps_in(group)) for group in diffraction_groups())


def follows_world() -> bool:
    """Whether some Diffraction group that the file uses reads the sources of worlds."""
    return any(group.users and lights_of(group) == REST for group in diffraction_groups())


def linked_with_fewer_lamps(scene: bpy.types.Scene) -> list[str]:
    """One warning line for each linked (so read-only) Diffraction group with fewer lamps than the scene follows, and
    one for each that shows lamps which the artist leaves out."""
    count, left_out = lamp_count(scene), left_out_count(scene)
    groups = [group for group in diffraction_groups() if group.library is not None]
    fewer = [(group.name, len(lamps_in(group))) for group in groups if len(lamps_in(group)) < count]
    lines = [f"{name}: linked with only {held} of {count} lamps; make it local" for name, held in fewer]
    showing = [group.name for group in groups if lights_of(group) == REST and left_out_in(group) < left_out]
    return lines + [f"{name}: linked, so it shows lamps that you leave out; make it local" for name in showing]


# The bytes of constants reserved for the rest of a material: ten Principled BSDFs or a hundred other nodes.
_LEFT = 2048
_REMEDY = "use fewer lamps, or fewer gratings in its Variation"
_ALIKE = "use fewer lamps, or bake the gratings of its Variation with one Coherence, Material and Lamp Spectrum"
_BASE = Socket("Base", "Shader", "The material under the relief")
_BASE_BLEND = Socket(
    "Base Blend", "Float", "0: a clear coat over the base. 0.1: the thesis's mix. 1: no coat", 0.0, 0.0, 1.0, "FACTOR"
)
_STRENGTH = Socket("Strength", "Float", "Multiplies the brightness. 1: as the real surface", 1.0, 0.0, 1000.0)
_ROTATION = Socket("Rotation", "Float", "Turns the scan about the normal, and its colours", 0.0, -1e3, 1e3, "ANGLE")
_NORMAL = Socket("Normal", "Vector", "Shading normal; the surface's own if nothing is linked")
_TANGENT = Socket(
    "Tangent", "Vector", "Direction of the scan's x axis (left to right); the grating's own if nothing is linked"
)
_INPUTS = (
    _BASE, _BASE_BLEND, _STRENGTH, ROUGHNESS, IOR, _ROTATION, PERIOD_SCALE, HEIGHT_SCALE, _NORMAL, _TANGENT,
)  # fmt: skip
# Inputs that an artist sets by a number.
SETTABLE = {socket.name: socket for socket in _INPUTS if socket.default is not None}
_OUTPUTS = (
    Socket("Shader", "Shader", "The whole material"),
    Socket("Diffraction", "Color", "The diffracted light alone, as a colour"),
)


def group_around(name: str, response: Response, **settings: Any) -> bpy.types.NodeTree:
    """A new Diffraction group around a response, with inputs for the lamps that the file's scenes follow. `settings`
    are some of group_properties.settings_of; by default it traces shadows and answers to lamps and worlds."""
    group = bpy.data.node_groups.new(f"Diffraction {name}", "ShaderNodeTree")
    add_interface(group, _INPUTS, _OUTPUTS)
    group.default_group_node_width = GROUP_WIDTH
    note_settings(group, **{"lights": REST} | settings)
    _note_lights(group)
    fill_group(group, (response,), lamps_of_file(), sources=sources_of_file())
    return group


def set_up(group: bpy.types.NodeTree, **settings: Any) -> None:
    """Set some of a Diffraction group's settings (group_properties.settings_of). Its nodes are rebuilt once, and only
    if one of them changes."""
    if note_settings(group, **settings):
        _note_lights(group)
        fill_group(group, responses_in(group), lamps_in(group), sources=sources_of_file())


def _note_lights(group: bpy.types.NodeTree) -> None:
    """Set what a Diffraction group must know of the file's lights, beside their numbers."""
    group[group_properties.LEFT_OUT] = left_out_of_file()
    note_areas(group, areas_of_file())
    note_coloured(group, coloured_of_file(), sources=has_coloured_sources())


def is_outdated(group: bpy.types.NodeTree) -> bool:
    """Whether another version of Blender saved a Diffraction group, which this version shows wrongly."""
    return is_of_other_version(group, traced=traces_shadows(group))


def is_whole(group: bpy.types.NodeTree) -> bool:
    """Whether a Diffraction group has its sockets and its original numbers of nodes and links."""
    return has_sockets(group, _INPUTS, _OUTPUTS) and has_parts(group)


def take_back(group: bpy.types.NodeTree | None) -> bpy.types.NodeTree | None:
    """The node group if it is a Diffraction group, else None. Marks a group again that lost its custom properties."""
    if group is None or group.bl_idname != "ShaderNodeTree":
        return None
    if not is_diffraction(group) and responses_in(group):
        group[group_properties.LAMPS] = [False]
    return group if is_diffraction(group) else None


def set_variation(group: bpy.types.NodeTree, variation: Variation, others: Iterable[Response]) -> None:
    """Vary a Diffraction group over the surface between its own response and the others, one for each share."""
    own, others = response_in(group), list(others)
    if own is not None and (variation_of(group), list(further_responses(group))) != (variation, others):
        group[group_properties.VARIATION] = variation.as_property()
        refill(group, (own, *others))


def needs_lamps() -> bool:
    """Whether some Diffraction group in the file is black without lamps."""
    return any(lights_of(group) == LAMPS_ONLY or not answers_to_world(group) for group in diffraction_groups())


def answers_to_world(group: bpy.types.NodeTree) -> bool:
    """Whether a Diffraction group can show light that does not come from lamps."""
    return all(response.world is not None for response in responses_in(group))


def refill(group: bpy.types.NodeTree, responses: tuple[Response, ...]) -> None:
    """Rebuild a Diffraction group's nodes around responses, with its present lamps and sources. Several become layers
    of one picture if they can."""
    varied = len(responses) > 1 or layered_in(group) is not None
    if varied:
        from .direct.layers import make_layers, remove_unused_layers  # most sessions begin without it

        make_layers(responses)
    fill_group(group, responses, lamps_in(group), sources=sources_in(group))
    if varied:
        remove_unused_layers()


def fill_group(
    group: bpy.types.NodeTree, responses: tuple[Response, ...], lamps: list[bool], *, sources: int = 0
) -> None:
    """Rebuild a Diffraction group's nodes. Sockets and their links stay. `lamps`: for each lamp, whether light linking
    applies. Without responses (its own was deleted) the group is unchanged until replace_response repairs it. The
    group's own response takes over the shares of deleted further ones."""
    if not responses:
        return
    from ..nodes.interface import arrange
    from .skin_nodes import make_nodes  # most sessions begin without it

    group.nodes.clear()
    restore_interface(group, _INPUTS, _OUTPUTS)
    group[group_properties.LAMPS], group[group_properties.SOURCES] = lamps, sources
    read = sources
    while True:
        make_nodes(group, responses, lamps, sources=read)
        size = size_of(group)
        excess = size.constant_bytes - (ROOM - _LEFT)
        if excess <= 0 or read == 0 or lights_of(group) != REST:
            break
        # One source takes at most its share of the constants, so this removes no more sources than necessary.
        read -= min(read, math.ceil(excess / size.constant_bytes * (len(lamps) + read)))
    group[group_properties.READ], group[group_properties.CONSTANTS] = read, size.constant_bytes
    group[group_properties.SIZE] = [float(size.nodes), float(size.look_ups)]
    arrange(group)
    note_parts(group)


def crowded(group: bpy.types.NodeTree) -> list[str]:
    """A warning line if a Diffraction group's constants leave no room in EEVEE for all sources or all lamps."""
    held, sources = stored.count(group, group_properties.CONSTANTS, 2**31), sources_in(group)
    if held > ROOM - _LEFT:
        return [too_large(group.name)]
    left_out = sources - (
        stored.count(group, group_properties.READ, sources) if group_properties.READ in group else sources
    )
    if left_out <= 0 or lights_of(group) != REST:
        return []
    told = f"{left_out} of the world's {sources} bright spots are noisy, because EEVEE has no room for them"
    return [f"{group.name}: {told}; {_REMEDY}"]


# With 68 look-ups (a snake of two gratings under three suns) a further sample took a graphics card (NVIDIA H200) 8
# times as long as a metal's; with 22 (a disc under one) twice.
_HEAVY_LOOK_UPS = 40


def cost_of(group: bpy.types.NodeTree) -> str:
    """A line that tells what a Diffraction group costs in each sample; empty if that is not noted."""
    noted = stored.numbers(group, group_properties.SIZE, 2)
    if noted is None:
        return ""
    nodes, look_ups = map(int, noted)
    return translated("Nodes: {nodes}; look-ups a sample: {look_ups}", nodes=nodes, look_ups=look_ups)


def heavy(group: bpy.types.NodeTree) -> list[str]:
    """A line if a Diffraction group takes a graphics card several times as long as a metal."""
    _, look_ups = stored.numbers(group, group_properties.SIZE, 2) or (0.0, 0.0)
    if look_ups <= _HEAVY_LOOK_UPS:
        return []
    apart = variation_of(group).shares and layered_in(group) is None
    remedy = _ALIKE if apart else _REMEDY
    return [f"{group.name}: slow on a graphics card, by its {look_ups:.0f} look-ups a sample; {remedy}"]


def warnings_of(group: bpy.types.NodeTree) -> list[str]:
    """A line for each reason why a Diffraction group renders slowly or loses lights."""
    return [*crowded(group), *heavy(group)]


def too_large(name: str) -> str:
    """The warning for a group or a material that is too large for EEVEE."""
    return f"{name}: too large for EEVEE, which may show it magenta; {_REMEDY}, or render with Cycles"


def show_lamps(*, exactly: bool) -> None:
    """Give each Diffraction group in the file as many lamps as any scene follows or leaves out, and light linking if
    used.

    Groups that have enough are unchanged, because Blender would recompile them. With `exactly`, surplus lamps are
    removed too; they only cost time in each pixel, as their missing properties read as 0."""
    groups = [group for group in diffraction_groups() if group.library is None]
    if not groups:
        return
    wanted, sources, left_out = lamps_of_file(), sources_of_file(), left_out_of_file()
    areas, coloured, coloured_sources = areas_of_file(), coloured_of_file(), has_coloured_sources()
    trees: list[bpy.types.NodeTree | None] = []
    for group in groups:
        present, held, masks, shapes = lamps_in(group), sources_in(group), left_out_in(group), areas_in(group)
        lamps = wanted if exactly else [a or b for a, b in zip_longest(wanted, present, fillvalue=False)]
        reads_sources = lights_of(group) == REST
        count = (sources if exactly else max(sources, held)) if reads_sources else held
        wanted_masks = (left_out if exactly else max(left_out, masks)) if reads_sources else masks
        wanted_shapes = (areas if exactly else areas | shapes) if reads_sources else shapes
        spectra, of_sources = coloured_in(group), reads_source_spectra(group)
        wanted_spectra = (coloured if exactly else coloured | spectra), coloured_sources or (of_sources and not exactly)
        shown = (*responses_in(group), layered_in(group))
        spectral = [response for response in shown if response is not None and response.is_spectral]
        trees += [tree for response in spectral for tree in (response.group, response.world)]
        if not spectral:
            wanted_spectra = spectra, of_sources
        now = present, held, masks, shapes, (spectra, of_sources)
        if now != (lamps, count, wanted_masks, wanted_shapes, wanted_spectra):
            group[group_properties.LEFT_OUT] = wanted_masks
            note_areas(group, wanted_shapes)
            note_coloured(group, wanted_spectra[0], sources=wanted_spectra[1])
            fill_group(group, responses_in(group), lamps, sources=count)
    if trees:
        from .atlas_nodes import renew_lamp_tables  # most files do not need it

        renew_lamp_tables(trees)


def renew_outdated() -> list[str]:
    """Rebuild Diffraction groups that another version of Blender saved. Return a line to print if there were any.
    Linked groups stay as they are (lost_parts.py reports them)."""
    outdated = [group for group in diffraction_groups() if group.library is None and is_outdated(group)]
    for group in outdated:
        refill(group, responses_in(group))
    renewed = ", ".join(group.name for group in outdated if not is_outdated(group))
    version = "{}.{}".format(*bpy.app.version)
    return [f"{renewed}: nodes rebuilt for Blender {version}, because another version saved them"] if renewed else []
