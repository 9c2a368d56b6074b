# SPDX-License-Identifier: GPL-3.0-or-later
"""What a surface answers to light: the contract between a skin and the things that know the relief.

A skin (skin.py) asks one question for each lamp: the sockets of QUESTION. A Response answers it. It is a node group: of
nodes that read a bake's table (direct/), or around a shader (osl/). Its answer to a lamp is an Emission: light that the
surface sends to the viewer. To light from places that are not known it answers by a second group (lobes/), whose
outputs WORLD_ANSWER are two glossy closures: the mirror image, and one order of the scattered light.

Saved .blend files hold these groups, so the names of their sockets stay as they are.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import count, takewhile

import bpy

from ...precompute.optics.fresnel import KERATIN_IOR
from ..blender import compat, stored
from ..nodes.builder import Operand, Tree, Value
from ..nodes.interface import INPUT, Socket, has_sockets, sockets_of

NORMAL = Socket("Normal", "Vector", "Shading normal")
TANGENT = Socket("Tangent", "Vector", "Direction of the scan's x axis (left to right) on the surface")
TO_LIGHT = Socket("To Light", "Vector", "Unit vector to the lamp")
IRRADIANCE = Socket("Irradiance", "Vector", "On a surface that faces the lamp, W/m2")
VARIANCE = Socket("Variance", "Float", "Of the lamp's disc in the sky, rad2", 0.0, 0.0, 10.0)
ROUGHNESS = Socket("Roughness", "Float", "Of the skin over the relief: blurs the colours", 0.0, 0.0, 1.0, "FACTOR")
IOR = Socket("IOR", "Float", "Index of refraction: 1.56 is keratin, 2.5 and above metal-like", KERATIN_IOR, 1.0, 10.0)
PERIOD_SCALE = Socket(
    "Period Scale", "Float", "Stretches the relief along the surface; 2 halves its colours' angles", 1.0, 0.1, 10.0
)
HEIGHT_SCALE = Socket(
    "Height Scale", "Float", "Scales the relief's heights: 0 is a mirror, 1 is as baked", 1.0, 0.0, 1.0, "FACTOR"
)
CONSERVING = Socket(
    "Energy Conserving", "Float", "1 never reflects more than arrives; 0 is Stam's formula", 1.0, 0.0, 1.0, "FACTOR"
)
ZERO_ORDER = Socket(
    "Zero Order", "Float", "0 leaves the mirror image out, where a closure shows it", 1.0, 0.0, 1.0, "FACTOR"
)
SHARP = Socket("Sharp", "Float", "1: an order comes from one direction; 0: from a lobe", 0.0, 0.0, 1.0, "FACTOR")
# What an artist sets on the material and every response may use.
SETTINGS = (ROUGHNESS, IOR, PERIOD_SCALE, HEIGHT_SCALE, CONSERVING)
QUESTION = (NORMAL, TANGENT, TO_LIGHT, IRRADIANCE, VARIANCE, ZERO_ORDER, *SETTINGS)
WORLD_QUESTION = (NORMAL, TANGENT, SHARP, *SETTINGS)

RADIANCE = Socket("Finer", "Color", "Radiance by the finer of the two levels")
COARSER = Socket("Coarser", "Color", "Radiance by the coarser of the two levels")
COARSER_SHARE = Socket("Coarser Share", "Float", "Share of the coarser in their mix")
# The outputs of a response that gives one radiance, and of a response that gives a radiance at each of two levels of
# blur.
ONE_RADIANCE = (RADIANCE,)
TWO_RADIANCES = (RADIANCE, COARSER, COARSER_SHARE)

MIRROR = Socket("Mirror", "Color", "The zero order's reflectance")
MIRROR_ROUGHNESS = Socket("Mirror Roughness", "Float", "Of the zero order's closure")
LOBE = Socket("Lobe", "Color", "Reflectance of the order that was drawn, over its probability")
LOBE_NORMAL = Socket("Lobe Normal", "Vector", "Normal of the mirror that sends the order to the viewer")
LOBE_ROUGHNESS = Socket("Lobe Roughness", "Float", "Of the order's closure")
LOBE_DIRECTION = Socket("Lobe Direction", "Vector", "Unit vector to where the order comes from")
WORLD_ANSWER = (MIRROR, MIRROR_ROUGHNESS, LOBE, LOBE_NORMAL, LOBE_ROUGHNESS, LOBE_DIRECTION)

_LABEL, _WORLD_LABEL = "Response", "World Response"
_NUMBERED = re.compile("(?:World )?Response(?: ([1-9][0-9]*))?")
# A custom property of a response's node group, also in saved files.
_SPACE = "ng_space"


@dataclass(frozen=True)
class Shown:
    """What a material shows: its shader, and the diffracted radiance in it as a colour (for the AOV), which is
    `colour` times `share` and is multiplied only in a sum: EEVEE has 64 KiB for all constants of a material."""

    shader: Value
    colour: Value
    share: Value | None = None

    @property
    def radiance(self) -> Value:
        """The diffracted radiance."""
        return self.colour if self.share is None else self.colour * self.share

    def dimmed(self, share: Value) -> Shown:
        """The shader and the colour, both times a share from 0 to 1. Cycles evaluates nothing where the share is 0."""
        shader = self.shader.tree.mix_shader(share, None, self.shader)
        return Shown(shader, self.colour, share if self.share is None else self.share * share)

    def added_to(self, other: Shown | None) -> Shown:
        """The sum of this and the other; this alone if there is no other."""
        if other is None:
            return self
        shader = self.shader.tree.add_shader(other.shader, self.shader)
        if self.share is None:
            return Shown(shader, other.radiance + self.colour)
        return Shown(shader, self.colour.times_plus(self.share, other.radiance))


@dataclass(frozen=True)
class Emission:
    """The answer to a lamp: radiance towards the viewer in W/m2/sr, shown as emitted light.

    A response that holds two levels of blur gives both radiances and the share of the coarser one, which may lie
    outside 0 to 1 and is then clamped. Cycles evaluates only the levels whose share is not 0."""

    radiance: Value
    coarser: Value | None = None
    coarser_share: Value | None = None

    def shown(self, strength: Operand) -> Shown:
        """The emission as a shader, times a strength, and its radiance as a colour, without the strength."""
        tree = self.radiance.tree
        shader = tree.emission(self.radiance, strength)
        if self.coarser is None or self.coarser_share is None:
            return Shown(shader, self.radiance)
        shader = tree.mix_shader(self.coarser_share, shader, tree.emission(self.coarser, strength))
        share = tree.maximum(tree.minimum(self.coarser_share, 1.0), 0.0)
        return Shown(shader, tree.mix(share, self.radiance, self.coarser))


@dataclass(frozen=True)
class WorldAnswer:
    """The answer to light from places that are not known: two closures, by the outputs of WORLD_ANSWER.

    A lobe is one order that was drawn at random. `direction` is the unit vector to where it comes from."""

    mirror: Value
    mirror_roughness: Value
    lobe: Value
    lobe_normal: Value
    lobe_roughness: Value
    direction: Value

    def mirror_closure(self, normal: Value, strength: Operand) -> Value:
        """The zero order: a mirror, blurred by the coherence kernel."""
        return self.mirror.tree.glossy(self.mirror * strength, self.mirror_roughness, normal)

    def lobe_closure(self, strength: Operand) -> Value:
        """The order that was drawn."""
        return self.lobe.tree.glossy(self.lobe * strength, self.lobe_roughness, self.lobe_normal)


def note_working_space(response: Response) -> None:
    """Note the linear space that a response's colours are in. Nodes hold it as numbers, which stay what they are where
    Blender converts a file to another space, or where the group is linked into a file of another."""
    response.group[_SPACE] = compat.working_space()


def in_other_spaces(groups: Iterable[bpy.types.NodeTree]) -> list[str]:
    """A line for each Diffraction group whose colours are in another linear space than the file's."""
    now = compat.working_space()
    lines = []
    for group in groups:
        made = {stored.text(response.group, _SPACE) for response in responses_in(group) if is_in_other_space(response)}
        if made:
            told = " and ".join(sorted(made))
            lines.append(f"{group.name}: its colours are of {told}, and the file's of {now}; bake or assign it again")
    return lines


def is_in_other_space(response: Response) -> bool:
    """Whether a response's colours are in another linear space than the file's."""
    now = compat.working_space()
    return stored.text(response.group, _SPACE, now) != now


@dataclass(frozen=True)
class Response:
    """A node group that answers to one lamp: its inputs are among QUESTION, its outputs ONE_RADIANCE or
    TWO_RADIANCES. `world` answers to light of every kind; None where the surface cannot."""

    group: bpy.types.NodeTree
    world: bpy.types.NodeTree | None = None

    @property
    def inputs(self) -> tuple[Socket, ...]:
        """The part of the question that this response needs."""
        names = {item.name for item in sockets_of(self.group, INPUT)}
        return tuple(socket for socket in QUESTION if socket.name in names)

    def to_lamp(self, tree: Tree, question: Mapping[Socket, Operand], *, number: int = 1) -> Emission:
        """Add the response's node to a tree; its answer. The question has a value for each socket of QUESTION. The
        number tells the responses of one tree apart."""
        asked = {socket.name: question[socket] for socket in self.inputs}
        outputs = tree.group(self.group, asked, label=_numbered(_LABEL, number))
        coarser, share = (outputs.get(socket.name) for socket in (COARSER, COARSER_SHARE))
        return Emission(outputs[RADIANCE.name], coarser, share)

    def to_world(self, tree: Tree, question: Mapping[Socket, Operand], *, number: int = 1) -> WorldAnswer | None:
        """Add the node of the answer to a world, if there is one, to a tree; the answer. The question has a value for
        each socket of WORLD_QUESTION."""
        if self.world is None:
            return None
        asked = {socket.name: question[socket] for socket in WORLD_QUESTION}
        outputs = tree.group(self.world, asked, label=_numbered(_WORLD_LABEL, number))
        return WorldAnswer(*(outputs[socket.name] for socket in WORLD_ANSWER))


def response_in(group: bpy.types.NodeTree) -> Response | None:
    """The response around which a Diffraction group was made; the group may have been loaded from a file. None if an
    artist has deleted it."""
    return next(iter(responses_in(group)), None)


def responses_in(group: bpy.types.NodeTree) -> tuple[Response, ...]:
    """The responses of a Diffraction group: its own, and those of further gratings that it is varied by. Responses that
    an artist has deleted are left out, and so are the ones after them; without its own response, a group has none."""
    found = _sound_trees(group)
    numbers = takewhile(lambda number: found.get(_numbered(_LABEL, number)) is not None, count(1))
    return tuple(_response(found, number) for number in numbers)


def further_responses(group: bpy.types.NodeTree) -> tuple[Response, ...]:
    """The responses by which a Diffraction group is varied, also if its own response was deleted."""
    found = _sound_trees(group)
    numbers = takewhile(lambda number: found.get(_numbered(_LABEL, number)) is not None, count(2))
    return tuple(_response(found, number) for number in numbers)


def is_response(node: bpy.types.Node) -> bool:
    """Whether a node of a Diffraction group shows a response."""
    return node.type == "GROUP" and _NUMBERED.fullmatch(node.label) is not None


def trees_at(group: bpy.types.NodeTree) -> list[tuple[int, bpy.types.NodeTree | None]]:
    """The number of each node of a response in a Diffraction group, of which 1 is the group's own, and what it shows:
    None where that, or a socket of it, was deleted."""
    found = ((_NUMBERED.fullmatch(label), tree) for label, tree in _sound_trees(group).items())
    return [(int(numbered[1] or 1), tree) for numbered, tree in found if numbered]


def own_trees(group: bpy.types.NodeTree) -> tuple[bpy.types.NodeTree | None, bpy.types.NodeTree | None]:
    """The node groups of a Diffraction group's own response, to lamps and to a world. None for one that was deleted, or
    that never was."""
    found = _trees(group)
    return found.get(_LABEL), found.get(_WORLD_LABEL)


def _trees(group: bpy.types.NodeTree) -> dict[str, bpy.types.NodeTree | None]:
    """What the nodes of responses in a Diffraction group show, by the labels of the nodes."""
    return {node.label: node.node_tree for node in group.nodes if is_response(node)}


def _sound_trees(group: bpy.types.NodeTree) -> dict[str, bpy.types.NodeTree | None]:
    """The same, with None for a node group that lacks a socket of a response, or is none."""
    return {label: tree if tree and _has_answer(label, tree) else None for label, tree in _trees(group).items()}


def _has_answer(label: str, tree: bpy.types.NodeTree) -> bool:
    """Whether a node group has the sockets of what a label says it is."""
    if label.startswith(_WORLD_LABEL):
        return has_sockets(tree, WORLD_QUESTION, WORLD_ANSWER)
    return has_sockets(tree, (), TWO_RADIANCES) or has_sockets(tree, (), ONE_RADIANCE)


def _response(found: Mapping[str, bpy.types.NodeTree | None], number: int) -> Response:
    own = found[_numbered(_LABEL, number)]
    assert own is not None  # the callers number those that are there
    return Response(own, found.get(_numbered(_WORLD_LABEL, number)))


def _numbered(label: str, number: int) -> str:
    return label if number == 1 else f"{label} {number}"
