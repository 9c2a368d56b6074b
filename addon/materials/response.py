# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface between a skin and its responses.

A skin (skin.py) sends the inputs in QUESTION for each lamp. A Response is a node group that returns the light towards
the viewer. It contains nodes that read a bake's table (direct/) or a shader (osl/). For light from
unknown directions it has a second group (lobes/), whose outputs WORLD_ANSWER are two glossy closures: the mirror image,
and one order of the scattered light.

Saved .blend files contain these groups, so the names of their sockets must not change."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from itertools import count, takewhile
from typing import NamedTuple

import bpy

from ...precompute.optics.brdf import IOR_MAX, KERATIN_IOR
from ..blender import stored
from ..blender.working_space import working_space
from ..nodes.builder import Operand, Tree, Value
from ..nodes.interface import INPUT, Socket, has_sockets, sockets_of

NORMAL = Socket("Normal", "Vector", "Shading normal")
TANGENT = Socket("Tangent", "Vector", "Direction of the scan's x axis (left to right) on the surface")
TO_LIGHT = Socket("To Light", "Vector", "Unit vector to the lamp")
IRRADIANCE = Socket("Irradiance", "Vector", "Light on a surface that faces the lamp, in W/m2")
VARIANCE = Socket("Variance", "Float", "Spread of the lamp's disc in the sky, in rad2", 0.0, 0.0, 10.0)
ROUGHNESS = Socket("Roughness", "Float", "Softness: blurs the colours, as a rough skin does", 0.0, 0.0, 1.0, "FACTOR")
IOR = Socket(
    "IOR", "Float", "Index of refraction: a higher one reflects more light. 1.56: horn and skin (keratin). "
    "A baked metal or film ignores it", KERATIN_IOR, 1.0, IOR_MAX,
)  # fmt: skip
PERIOD_SCALE = Socket(
    "Period Scale", "Float",
    "Hue by Period: stretches the lines, which moves each hue to another angle. 2: the colours lie at half the angles. "
    "Above 1, light is missing where lamp and camera both lean far to the same side (|u| above 2 / Period Scale)",
    1.0, 0.1, 10.0,
)  # fmt: skip
HEIGHT_SCALE = Socket(
    "Height Scale", "Float", "Scales the relief's heights: 0 is a mirror, 1 is as baked", 1.0, 0.0, 1.0, "FACTOR"
)
ZERO_ORDER = Socket(
    "Zero Order", "Float", "0: without the mirror reflection, which another shader shows", 1.0, 0.0, 1.0, "FACTOR"
)
SHARP = Socket("Sharp", "Float", "1: an order comes from one direction; 0: from a lobe", 0.0, 0.0, 1.0, "FACTOR")
SPECTRUM = Socket("Spectrum", "Float", "The lamp's row in the table of lamps; 0 is white", 0.0)
LAYER = Socket("Layer", "Float", "The number of the bake to show, of several in one picture", 0.0)
# Settings on the material that all responses may use.
SETTINGS = (ROUGHNESS, IOR, PERIOD_SCALE, HEIGHT_SCALE)
QUESTION = (NORMAL, TANGENT, TO_LIGHT, IRRADIANCE, VARIANCE, ZERO_ORDER, *SETTINGS)
WORLD_QUESTION = (NORMAL, TANGENT, SHARP, *SETTINGS)

RADIANCE = Socket("Finer", "Color", "Radiance by the finer of the two levels")
COARSER = Socket("Coarser", "Color", "Radiance by the coarser of the two levels")
COARSER_SHARE = Socket("Coarser Share", "Float", "Share of the coarser in their mix")
MIRRORED = Socket("Mirror", "Color", "Radiance of the mirror reflection")
MIRRORED_SHARE = Socket("Mirror Share", "Float", "Share of the mirror reflection; 0 where there is none")
LIKELY = Socket("Likely", "Float", "About the light per irradiance, at little cost, for a choice among lamps")
# The outputs of a response with one radiance (a shader's), and of one with a radiance at each of two blur levels and
# the mirror image apart.
ONE_RADIANCE = (RADIANCE,)
RADIANCES = (*ONE_RADIANCE, COARSER, COARSER_SHARE, MIRRORED, MIRRORED_SHARE, LIKELY)
# The radiances under a lamp of a SPECTRUM, which a bake of more channels than XYZ also has.
OF_LAMP = {
    each: Socket(f"{each.name} of Lamp", "Color", f"{each.text}, by the lamp's own spectrum")
    for each in (RADIANCE, COARSER, MIRRORED)
}
SPECTRAL_RADIANCES = (*RADIANCES, *OF_LAMP.values())

MIRROR = Socket("Mirror", "Color", "Reflectance of the mirror reflection (zero order)")
MIRROR_ROUGHNESS = Socket("Mirror Roughness", "Float", "Roughness of the mirror reflection")
LOBE = Socket("Lobe", "Color", "Reflectance of the order that was drawn, over its probability")
LOBE_NORMAL = Socket("Lobe Normal", "Vector", "Normal of the mirror that sends the order to the viewer")
LOBE_ROUGHNESS = Socket("Lobe Roughness", "Float", "Roughness of the reflection of the order")
LOBE_DIRECTION = Socket("Lobe Direction", "Vector", "Unit vector to where the order comes from")
WORLD_ANSWER = (MIRROR, MIRROR_ROUGHNESS, LOBE, LOBE_NORMAL, LOBE_ROUGHNESS, LOBE_DIRECTION)
# Both colours under a world of a SPECTRUM, which a bake of more channels than XYZ also has.
OF_WORLD = {
    each: Socket(f"{each.name} of World", "Color", f"{each.text}, by the world's own spectrum")
    for each in (MIRROR, LOBE)
}
SPECTRAL_WORLD_ANSWER = (*WORLD_ANSWER, *OF_WORLD.values())

_LABEL, _WORLD_LABEL, _LIKELY_LABEL = "Response", "World Response", "Likely Response"
# The number of a response that has the others as layers (direct/layers.py). It is not one of a group's responses.
LAYERED = 0
_NUMBERED = re.compile("(?:World |Likely )?Response(?: ([1-9][0-9]*))?")
# Custom property of a response's node group, saved in files: the linear space of its colours.
_SPACE = "ng_space"


class WorldAnswer(NamedTuple):
    """The reflection of light from unknown directions: closures from the outputs of WORLD_ANSWER. The lobe is one
    randomly drawn order; `direction` is the unit vector to where its light comes from."""

    mirror: Value
    mirror_roughness: Value
    lobe: Value
    lobe_normal: Value
    lobe_roughness: Value
    direction: Value

    def closures(self, normal: Value, strength: Operand, lobe_strength: Operand) -> Value:
        """The closures of the zero order (a mirror as rough as the skin) and of the drawn order."""
        tree = self.mirror.tree
        mirror = tree.glossy(self.mirror * strength, self.mirror_roughness, normal)
        lobe = tree.glossy(self.lobe * lobe_strength, self.lobe_roughness, self.lobe_normal)
        return tree.add_shader(mirror, lobe)


def note_working_space(response: Response) -> None:
    """Store the linear space of a response's colours. Nodes hold the colours as numbers, which do not change if Blender
    converts the file to another space or if the group is linked into a file with another space."""
    response.group[_SPACE] = working_space()


def in_other_spaces(groups: Iterable[bpy.types.NodeTree]) -> list[str]:
    """One warning line for each Diffraction group whose colours are in another linear space than the file."""
    now = working_space()
    lines = []
    for group in groups:
        made = {stored.text(response.group, _SPACE) for response in responses_in(group) if is_in_other_space(response)}
        if made:
            told = " and ".join(sorted(made))
            lines.append(f"{group.name}: its colours are of {told}, and the file's of {now}; bake or assign it again")
    return lines


def is_in_other_space(response: Response) -> bool:
    """Whether a response's colours are in another linear space than the file's."""
    now = working_space()
    return stored.text(response.group, _SPACE, now) != now


class Response(NamedTuple):
    """A node group that computes the light of one lamp: its inputs are among QUESTION, its outputs ONE_RADIANCE,
    RADIANCES, or with the input SPECTRUM also SPECTRAL_RADIANCES. `world` is the node group for light from all
    directions; None if there is none."""

    group: bpy.types.NodeTree
    world: bpy.types.NodeTree | None = None

    @property
    def inputs(self) -> tuple[Socket, ...]:
        """The inputs among QUESTION that this response uses."""
        names = {item.name for item in sockets_of(self.group, INPUT)}
        return tuple(socket for socket in QUESTION if socket.name in names)

    def to_lamp(self, tree: Tree, question: Mapping[Socket, Operand], *, number: int = 1) -> Value:
        """Add the response's node for a lamp and return the radiance that it sends to the viewer, in W/m2/sr.
        `question` has a value for each socket of QUESTION, and for SPECTRUM if the lamp may have one. `number`
        distinguishes the responses in one tree.

        A ZERO_ORDER of 0 links no mirror image: EEVEE would compute it, and multiply it by 0."""
        outputs = self._asked(tree, question, _numbered(_LABEL, number))
        own = OF_LAMP if SPECTRUM in question and self.is_spectral else {}
        radiance, coarser, mirrored = (
            outputs.get(own.get(socket, socket).name) for socket in (RADIANCE, COARSER, MIRRORED)
        )
        assert radiance is not None  # every response has it
        if coarser is not None:
            share = tree.maximum(tree.minimum(outputs[COARSER_SHARE.name], 1.0), 0.0)
            radiance = tree.blend(share, radiance, coarser)
        if mirrored is not None and question[ZERO_ORDER] != 0.0:
            radiance = mirrored.times_plus(outputs[MIRRORED_SHARE.name], radiance)
        return radiance

    @property
    def is_spectral(self) -> bool:
        """Whether it can tell the light of lamps of several spectra."""
        return has_sockets(self.group, (SPECTRUM,), SPECTRAL_RADIANCES)

    @property
    def tells_likely(self) -> bool:
        """Whether it can tell about how much light it sends."""
        return has_sockets(self.group, (), RADIANCES) or self.is_spectral

    def likely(self, tree: Tree, question: Mapping[Socket, Operand], *, number: int = 1) -> Value:
        """Add the response's node for a lamp and return about the light that it sends to the viewer per irradiance, in
        units of its own. Blender evaluates only what this output needs."""
        return self._asked(tree, question, _numbered(_LIKELY_LABEL, number))[LIKELY.name]

    def keep(self, tree: Tree, *, number: int) -> None:
        """Add the response's nodes without links, so that the tree still has its responses if another one answers."""
        tree.group(self.group, label=_numbered(_LABEL, number))
        if self.world is not None:
            tree.group(self.world, label=_numbered(_WORLD_LABEL, number))

    def _asked(self, tree: Tree, question: Mapping[Socket, Operand], label: str) -> dict[str, Value]:
        asked = {socket.name: question[socket] for socket in (*self.inputs, *_layer(question))}
        if SPECTRUM in question and self.is_spectral:
            asked[SPECTRUM.name] = question[SPECTRUM]
        return tree.group(self.group, asked, label=label)

    def to_world(self, tree: Tree, question: Mapping[Socket, Operand], *, number: int = 1) -> WorldAnswer | None:
        """Add the response's node for light from unknown directions, if it has one, and return the closures, else None.
        `question` has a value for each socket of WORLD_QUESTION, and for SPECTRUM if the world may have one."""
        if self.world is None:
            return None
        spectral = SPECTRUM in question and has_sockets(self.world, (SPECTRUM,), SPECTRAL_WORLD_ANSWER)
        further = [*_layer(question), *([SPECTRUM] if spectral else [])]
        asked = {socket.name: question[socket] for socket in (*WORLD_QUESTION, *further)}
        outputs = tree.group(self.world, asked, label=_numbered(_WORLD_LABEL, number))
        own = OF_WORLD if spectral else {}
        return WorldAnswer(*(outputs[own.get(socket, socket).name] for socket in WORLD_ANSWER))


def _layer(question: Mapping[Socket, Operand]) -> tuple[Socket, ...]:
    """The socket of a layer, which is asked of a response with layers only."""
    return (LAYER,) if LAYER in question else ()


def response_in(group: bpy.types.NodeTree) -> Response | None:
    """The own response of a Diffraction group, which may come from a file; None if it was deleted."""
    return next(iter(responses_in(group)), None)


def responses_in(group: bpy.types.NodeTree) -> tuple[Response, ...]:
    """The responses of a Diffraction group: its own, then the further ones of its variation. The list ends before the
    first deleted response, so it is empty if the own response was deleted."""
    found = _sound_trees(group)
    numbers = takewhile(lambda number: found.get(_numbered(_LABEL, number)) is not None, count(1))
    return tuple(_response(found, number) for number in numbers)


def further_responses(group: bpy.types.NodeTree) -> tuple[Response, ...]:
    """The further responses of a Diffraction group's variation, even if its own response was deleted."""
    found = _sound_trees(group)
    numbers = takewhile(lambda number: found.get(_numbered(_LABEL, number)) is not None, count(2))
    return tuple(_response(found, number) for number in numbers)


def layered_in(group: bpy.types.NodeTree) -> Response | None:
    """The response with layers that answers for a Diffraction group's responses; None if each answers for itself."""
    found = {node.label: node.node_tree for node in group.nodes if node.type == "GROUP"}
    own = found.get(_numbered(_LABEL, LAYERED))
    return None if own is None else Response(own, found.get(_numbered(_WORLD_LABEL, LAYERED)))


def is_response(node: bpy.types.Node) -> bool:
    """Whether a node of a Diffraction group contains a response."""
    return node.type == "GROUP" and _NUMBERED.fullmatch(node.label) is not None


def trees_at(group: bpy.types.NodeTree) -> list[tuple[int, bpy.types.NodeTree | None]]:
    """The number and the node group of each response node in a Diffraction group; number 1 is its own response. The
    node group is None if it, or a socket of it, was deleted."""
    # Likely responses have the node groups of the others.
    found = ((_NUMBERED.fullmatch(label), tree) for label, tree in _sound_trees(group).items())
    return [
        (int(numbered[1] or 1), tree)
        for numbered, tree in found
        if numbered and not numbered[0].startswith(_LIKELY_LABEL)
    ]


def own_trees(group: bpy.types.NodeTree) -> tuple[bpy.types.NodeTree | None, bpy.types.NodeTree | None]:
    """The node groups of a Diffraction group's own response, for lamps and for a world; None for a missing one."""
    found = _trees(group)
    return found.get(_LABEL), found.get(_WORLD_LABEL)


def _trees(group: bpy.types.NodeTree) -> dict[str, bpy.types.NodeTree | None]:
    """The node groups of the response nodes in a Diffraction group, by the labels of the nodes."""
    return {node.label: node.node_tree for node in group.nodes if is_response(node)}


def _sound_trees(group: bpy.types.NodeTree) -> dict[str, bpy.types.NodeTree | None]:
    """The same, with None for a node group that lacks a socket of a response."""
    return {label: tree if tree and _has_answer(label, tree) else None for label, tree in _trees(group).items()}


def _has_answer(label: str, tree: bpy.types.NodeTree) -> bool:
    """Whether a node group has the sockets that belong to the label of its node."""
    if label.startswith(_WORLD_LABEL):
        return any(has_sockets(tree, WORLD_QUESTION, answer) for answer in (WORLD_ANSWER, SPECTRAL_WORLD_ANSWER))
    kinds = (SPECTRAL_RADIANCES, RADIANCES, ONE_RADIANCE)
    return any(has_sockets(tree, (), outputs) for outputs in kinds)


def _response(found: Mapping[str, bpy.types.NodeTree | None], number: int) -> Response:
    own = found[_numbered(_LABEL, number)]
    assert own is not None  # the callers pass numbers of present responses only
    return Response(own, found.get(_numbered(_WORLD_LABEL, number)))


def _numbered(label: str, number: int) -> str:
    if number == LAYERED:
        return f"Layered {label}"
    return label if number == 1 else f"{label} {number}"
