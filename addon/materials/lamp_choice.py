# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lamps light a point, and how many of them a sample answers to: two in place of all, so that a lamp more costs
little. Lamps too wide for a bake's table are shared by the table and a closure.

Each lamp i has a likely light p_i, which is cheap: the light that its answer may send, roughly. The lamp with the
largest p is always answered to. Of the others one is drawn at random, with the probability q_i = p_i / sum of their p,
and its light is divided by q_i. So the mean over many samples is the light of all lamps. The noise is small, because
the strongest lamp has none and the others are drawn in proportion to about what they send.

The choice is among the lamps as they are packed (lamps/lamp_drivers.py): numbers of the scene, which are constants of
a shader. A Cycles shader holds 255 numbers at once. So a lamp's light is computed for its p, and again for the chosen
two. With the lights of all lamps at once, twelve area lamps would make the material black.

Where materials have loops, one passes through the lamps, and what it keeps of them are two numbers (Choice)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import bpy

from ..lamps.lamp_group import (
    LAMP_OUTPUTS,
    SHAPE,
    Light,
    WholeLamp,
    lamp_and_point,
    light_from,
    light_of,
    packed_lamp,
    spectrum_of_lamp,
)
from ..nodes.builder import Operand, Tree, Value, shared_group
from ..nodes.interface import Socket

# A packed lamp's vectors, its fourth numbers with its row, and its p.
_VECTORS = tuple(Socket(name, "Vector", "Of the lamp") for name in ("Place", "Power", "Z", "X", "Numbers", "Others"))
_PACK = (*_VECTORS, Socket("Likely", "Float", "Of the lamp"))
_FIRST, _SECOND = (tuple(each._replace(name=f"{which} {each.name}") for each in _PACK) for which in ("First", "Second"))
_SHARE = Socket("Share", "Float", "0: the first lamp; 1: the second one")

# Up to this many lamps and sources each are answered to. Two answers and a draw take more time than three answers.
ALL_UP_TO = 3
# Each lamp's p is smaller by this share than it would be as the lamp before. So no two equal lamps are the strongest.
_APART = 2.0**-20
# Distinguishes the random number of the choice from those of the random order (lobes/lobes_group.py), and those of the
# two chosen lamps' points.
_SEED = 4.0
# What this multiplies adds nothing to a float. It sets the order in which Blender computes: it begins with the last
# input of a node, and needs all inputs first.
NOTHING = 1e-30


@dataclass(frozen=True)
class Candidate:
    """A light among which is chosen.

    packed  the vector and the fourth number of each property (lamps/lamp_drivers.py)
    light   at the shaded point; a WholeLamp if it may be an area lamp"""

    packed: Sequence[Operand]
    light: Light


@dataclass(frozen=True)
class Answered:
    """A light to answer to: packed, with its row (0: white), the seed of its random point, and what its irradiance is
    multiplied by."""

    packed: Sequence[Operand]
    row: Operand
    seed: Operand
    factor: Operand = 1.0


def answered_lamp(tree: Tree, index: int, linked: bool, *, coloured: bool) -> Answered:
    """Add nodes for the scene's lamp `index`. See lamp_for_table."""
    row = spectrum_of_lamp(tree, index, coloured)
    return Answered(packed_lamp(tree, index, linked), 0.0 if row is None else row, index + 1.0)


def lamp_candidate(tree: Tree, index: int, linked: bool, *, is_area: bool, coloured: bool) -> Candidate:
    """Add nodes for the scene's lamp `index`. See lamp_for_table."""
    packed, row = packed_lamp(tree, index, linked), spectrum_of_lamp(tree, index, coloured)
    return Candidate(packed, whole_light(tree, packed, areas=is_area, row=row, label=f"Lamp {index}"))


def two_answers(tree: Tree, candidates: Sequence[Candidate], likely: Sequence[Value]) -> list[Answered]:
    """The strongest light and one drawn of the others, whose factor is 1 over its probability.

    `likely` has each light's p, at least 0."""
    likely = [each * (1.0 - index * _APART) for index, each in enumerate(likely)]
    most = likely[0]
    for each in likely[1:]:
        most = tree.maximum(most, each)
    packs = [
        (*_packed(tree, candidate.packed, candidate.light.spectrum or 0.0), p)
        for candidate, p in zip(candidates, likely, strict=True)
    ]
    weaker = [tree.math("LESS_THAN", each, most) for each in likely]
    strongest = packs[0]
    for pack, is_weaker in zip(packs[1:], weaker[1:], strict=True):
        strongest = _either(tree, is_weaker, pack, strongest)
    below = [likely[0] * weaker[0]]
    for each, is_weaker in zip(likely[1:], weaker[1:], strict=True):
        below.append(each.times_plus(is_weaker, below[-1]))
    at = random_number(tree, _SEED) * below[-1]
    drawn = packs[-1]
    for pack, end in zip(packs[-2::-1], below[-2::-1], strict=True):
        here = tree.math("LESS_THAN", at, end)
        drawn = _either(tree, here, drawn, pack)
    *first, _ = strongest
    *second, p = drawn
    factor = tree.math("DIVIDE", below[-1], p)
    return [Answered(*_unpacked(tree, first), 2.0), Answered(*_unpacked(tree, second), 3.0, factor)]


def random_number(tree: Tree, seed: float) -> Value:
    """A random number from 0 to 1 of each sample. Numbers of different seeds are independent."""
    place = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Position"])
    noise = tree.node("ShaderNodeTexWhiteNoise", place, seed, noise_dimensions="4D")
    return tree.value(noise.outputs["Value"])


class Choice(NamedTuple):
    """The same choice among lights that come one by one, which a loop makes.

    passed       the number of lights so far
    most, best   the p of the strongest, and its number
    total        the sum of the others' p
    p, drawn     the p of the one drawn of these, and its number
    at           a random number from 0 to 1, independent of the choice so far"""

    passed: Operand
    most: Operand
    best: Operand
    total: Operand
    p: Operand
    drawn: Operand
    at: Operand

    @classmethod
    def of_none(cls, tree: Tree) -> Choice:
        """The choice before the first light. Its total is next to nothing, by which `at` can be divided."""
        return cls(0.0, 0.0, 0.0, NOTHING, 0.0, 0.0, random_number(tree, _SEED))

    def with_light(self, tree: Tree, p: Value) -> Choice:
        """The choice with one more light. If it is the strongest, the one that was competes in its place."""
        is_most = tree.math("GREATER_THAN", p, self.most)
        less = tree.minimum(p, self.most)
        weaker = tree.choice(is_most, self.passed, self.best)
        total = less + self.total
        along = total * self.at
        is_drawn = tree.math("LESS_THAN", along, less)
        # Where `along` is in its part of the total is random again.
        part = tree.choice(is_drawn, self.total, less)
        at = tree.math("DIVIDE", tree.choice(is_drawn, along - less, along), part)
        drawn = tree.choice(is_drawn, self.p, less), tree.choice(is_drawn, self.drawn, weaker)
        best = tree.choice(is_most, self.best, self.passed)
        return Choice(tree.math("ADD", self.passed, 1.0), tree.maximum(p, self.most), best, total, *drawn, at)

    def numbers(self, tree: Tree) -> list[tuple[Operand, float, Operand]]:
        """The number of each of the two lights, the seed of its point, and what its irradiance is multiplied by."""
        return [(self.best, 2.0, 1.0), (self.drawn, 3.0, tree.math("DIVIDE", self.total, self.p))]


def light_of_number(tree: Tree, number: Operand, lights: Sequence[Answered]) -> tuple[Sequence[Operand], Operand]:
    """One of the lights by its number: packed, and its row."""
    first, *others = (_packed(tree, light.packed, light.row) for light in lights)
    chosen: Sequence[Operand] = first
    for index, pack in enumerate(others):
        is_beyond = tree.math("GREATER_THAN", number, index + 0.5)
        # Each sample has its own number, so Cycles can leave out no mix: those of vectors take the least time.
        chosen = [tree.blend(is_beyond, a, b) for a, b in zip(chosen, pack, strict=True)]
    return _unpacked(tree, chosen)


def after(p: Value, rests: Sequence[Value]) -> list[Value]:
    """What is left for closures after a lamp, so that nothing of the lamp is needed once the first is known."""
    first, *others = rests
    for each in (*others, p):
        first = each.times_plus(NOTHING, first)
    return [first, *others]


def all_after(chances: Sequence[Value], rests: Sequence[Value]) -> list[Value]:
    """The p of all lamps, known only after what is left for closures."""
    nothing = rests[0] * NOTHING
    return [p + nothing for p in chances]


def whole_light(tree: Tree, packed: Sequence[Operand], *, areas: bool, row: Value | None, label: str = "Lamp") -> Light:
    """Add nodes for a packed lamp, with its row unless it is white; a WholeLamp if there may be area lamps."""
    light: Light
    if areas:
        light, _ = lamp_and_point(tree, packed, seed=0.0, label=label)
    else:
        light = light_from(tree, packed, label=label)
    return replace(light, spectrum=row)


def packed_light(
    tree: Tree, packed: Sequence[Operand], *, areas: bool, row: Value | None, seed: Operand, label: str = "Lamp"
) -> tuple[Light, Light]:
    """Add nodes for a packed lamp, with its row unless it is white: the lamp for closures, and its light as the table
    shows it. `areas`: a sample takes a random point of an area lamp."""
    if not areas:
        light = replace(light_from(tree, packed, label=label), spectrum=row)
        return light, light
    lamp, point = lamp_and_point(tree, packed, seed=seed, label=label)
    return lamp, _of_table(tree, lamp, replace(point, spectrum=row))


def _packed(tree: Tree, packed: Sequence[Operand], row: Operand) -> tuple[Operand, ...]:
    """A packed lamp and its row as vectors."""
    place, disc, power, scales, z, outer, x, inner = packed
    return place, power, z, x, tree.vector(disc, scales, outer), tree.vector(inner, row, 0.0)


def _unpacked(tree: Tree, vectors: Sequence[Operand]) -> tuple[Sequence[Operand], Operand]:
    """The packed lamp in the vectors, and its row."""
    place, power, z, x, *others = vectors
    split = (tree.node("ShaderNodeSeparateXYZ", each).outputs for each in others)
    disc, scales, outer, inner, row, _ = (tree.value(socket) for sockets in split for socket in sockets)
    return [place, disc, power, scales, z, outer, x, inner], row


def _either(tree: Tree, share: Value, first: tuple[Operand, ...], second: tuple[Operand, ...]) -> tuple[Value, ...]:
    """The first pack if the share is 0, the second if it is 1."""
    given: dict[str, Operand] = {_SHARE.name: share}
    given |= {each.name: value for each, value in zip((*_FIRST, *_SECOND), (*first, *second), strict=True)}
    outputs = tree.group(either_group(), given)
    return tuple(outputs[each.name] for each in _PACK)


def either_group() -> bpy.types.NodeTree:
    """The file's group that chooses between two packs, created if needed."""
    return shared_group("Either Lamp", (_SHARE, *_FIRST, *_SECOND), _PACK, build=_add_either)


def _add_either(tree: Tree) -> None:
    """The nodes of the group."""
    share, *packs = tree.inputs().values()
    *firsts, first = packs[: len(_PACK)]
    *seconds, second = packs[len(_PACK) :]
    vectors = (tree.blend(share, a, b) for a, b in zip(firsts, seconds, strict=True))
    tree.output(*vectors, tree.mix(share, first, second))


# 1 - cos of the angle from a lamp's centre to the rim of its cone, over the variance of its disc.
_CONE = 3.0
# Variances in rad2: lights up to the first are shown by the table alone, from the second on by the closure alone. They
# are the variances of discs with radii of 9 and 12.5 degrees.
_WIDE = (0.006, 0.012)
# The same of an area lamp, over those of other lights: 24 and 33 degrees. Its random points have its shape.
_AREA = 7.0
_NAME = "Light Left by Table"
_DIRECTION = Socket("Direction", "Vector", "Unit vector to where a closure looks")
_LIGHT = (*LAMP_OUTPUTS[:3], Socket("Share", "Float", "The share of the lamp that the table shows"))
_LEFT = Socket("Left", "Float", "The share of the light from there that is left for a closure")


def lamp_for_table(tree: Tree, index: int, linked: bool, *, is_area: bool, coloured: bool) -> tuple[Light, Light]:
    """Add nodes for the scene's lamp `index`: the lamp for closures, and its light as the table shows it. `linked`:
    apply light linking. `is_area`: it may be an area lamp, which takes a hundred nodes more. `coloured`: it may be of
    another spectrum than white."""
    if not is_area:
        light = light_of(tree, index, linked, coloured=coloured)
        return light, light
    packed, row = packed_lamp(tree, index, linked), spectrum_of_lamp(tree, index, coloured)
    return packed_light(tree, packed, areas=True, row=row, seed=index + 1.0, label=f"Lamp {index}")


def _of_table(tree: Tree, lamp: WholeLamp, point: Light) -> Light:
    """The light of a point of a lamp, as the table shows it."""
    # The point has a small variance, for which table_share gives 1.
    shown = (table_share(tree, lamp) - 1.0) * lamp.is_area + 1.0
    return replace(point, irradiance=point.irradiance * shown)


def table_share(tree: Tree, light: Light) -> Value:
    """The share of a light that the table shows: 1 for a compact light, 0 for a wide one.

    The table treats each light as a round Gaussian. A closure samples a wide light's true shape, and hits it often."""
    compact, wide = _WIDE
    variance = light.variance
    if isinstance(light, WholeLamp):
        variance = variance * light.is_area.times_plus(1 / _AREA - 1, 1.0)
    node = tree.node("ShaderNodeMapRange", variance, compact, wide, 1.0, 0.0, interpolation_type="SMOOTHSTEP")
    return tree.value(node.outputs["Result"])


def left_by_table(tree: Tree, light: Light, share: Value | float, *, direction: Value) -> Value:
    """The share of the light from a direction that a lamp leaves for a closure: 1 minus its share that the table shows
    if the lamp is there. A lamp with a share of 1 that the table does not show has no light at all."""
    given: dict[str, Operand] = {_DIRECTION.name: direction}
    held = light.direction, light.irradiance, light.variance, share
    given |= {socket.name: value for socket, value in zip(_LIGHT, held, strict=True)}
    if isinstance(light, WholeLamp):
        shape = light.is_area, light.is_round, light.away, *light.axes
        given |= {socket.name: value for socket, value in zip(SHAPE, shape, strict=True)}
    return tree.group(left_group(is_whole=isinstance(light, WholeLamp)), given)[_LEFT.name]


def left_group(*, is_whole: bool) -> bpy.types.NodeTree:
    """The file's group of the light that a lamp, or a WholeLamp, leaves for a closure; created if needed."""
    name, shape = (f"{_NAME} of Area", SHAPE) if is_whole else (_NAME, ())
    return shared_group(name, (_DIRECTION, *_LIGHT, *shape), (_LEFT,), build=_add_left)


def _add_left(tree: Tree) -> None:
    """The nodes of the group."""
    direction, towards, irradiance, variance, share, *shape = tree.inputs().values()
    shines = tree.math("GREATER_THAN", tree.dot(irradiance, (1.0, 1.0, 1.0)), 0.0)
    beside = variance.times_plus(_CONE, tree.dot(towards, direction))  # above 1 within the cone
    within = tree.math("GREATER_THAN", beside, 1.0)
    if shape:
        is_area, is_round, away, z, x, y = shape
        lamp = WholeLamp(towards, irradiance, variance, 0.0, share, is_area, is_round, away, (z, x, y))
        within = (lamp.is_met(direction) - within) * is_area + within
    tree.output(1.0 - shines * share * within)


# The least roughness that rough reflections see. A CD over floors of roughness 0.02, 0.1 and 0.3 keeps 0.94, 0.96 and
# 0.97 of its colour (the largest less the least channel) in them, with 1.05, 1.04 and 1.01 times the light of no blur,
# and 1.02, 1.03 and 1.10 times that of All by Samples (4096 samples, Clamp Indirect 0; Blender's default of 10 takes a
# third of All's). At 64 samples the pixels of a floor of 0.3 are at most 2.4 times the median of their neighbours,
# where 0.25 leaves 2.2 with a third of the colour, and no blur 4.0.
ROUGHNESS = 0.12


def rays(tree: Tree) -> tuple[Value, Value]:
    """Two numbers about the ray: 1 if it must not see the diffraction, else 0; and the least roughness that it sees.

    The camera sees the diffraction as it is, also in mirrors and through clear glass. A rough reflection sees blurred
    colours: its random rays would find narrow orders by chance and leave white dots. How rough the reflection is, a
    material cannot know. Diffuse bounces and fog do not see the diffraction."""
    path = tree.outputs_of(tree.node("ShaderNodeLightPath"))
    glossy = path["Is Glossy Ray"]  # mirrors and glass included
    sharp = tree.math("GREATER_THAN", path["Is Singular Ray"], path["Diffuse Depth"])
    unseen = tree.math("LESS_THAN", path["Is Camera Ray"] + glossy, 0.5)
    return unseen, tree.math("GREATER_THAN", glossy, sharp) * ROUGHNESS


def is_lit(tree: Tree, light: Light, *, n: Value, cos_r: Value, unseen: Value) -> Value:
    """1 if the lamp and the viewer are above the surface, the lamp is on, and the ray may see the diffraction; else 0.

    The numbers are compared with `unseen`, which is 1 for rays that must not see it, as no cosine exceeds 1."""
    least = tree.minimum(tree.minimum(cos_r, tree.dot(light.direction, n)), tree.dot(light.irradiance, (1.0, 1.0, 1.0)))
    return tree.math("GREATER_THAN", least, unseen)
