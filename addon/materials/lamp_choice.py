# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lamps light a point, and how many of them a sample answers to: two in place of all, so that a lamp more costs
little. Lamps too wide for a bake's table are shared by the table and a closure.

Each lamp i has a likely light p_i, which is cheap: the light that its answer may send, roughly. The lamp with the
largest p is always answered to. Of the others one is drawn at random, with the probability q_i = p_i / sum of their p,
and its light is divided by q_i. So the mean over many samples is the light of all lamps. The noise is small, because
the strongest lamp has none and the others are drawn in proportion to about what they send.

Each lamp carries two vectors and four numbers (the variance of its disc, how far away its shadows begin, p, and its row
in the table of lamps) along two chains: one keeps the strongest, one the drawn lamp. Blender does not evaluate the last
number where nothing uses it."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import bpy

from ..lamps.lamp_group import LAMP_OUTPUTS, SHAPE, Light, WholeLamp, lamp_and_point, light_of
from ..nodes.builder import Operand, Tree, Value, shared_group
from ..nodes.interface import Socket

# A light's direction, its irradiance, three numbers, and its row.
_Pack = tuple[Value, Value, Value, Operand]
_PACK = (
    *(Socket(name, "Vector", "Of the lamp") for name in ("Direction", "Irradiance", "Numbers")),
    Socket("Spectrum", "Float", "Of the lamp"),
)
_FIRST, _SECOND = (tuple(replace(each, name=f"{which} {each.name}") for each in _PACK) for which in ("First", "Second"))
_SHARE = Socket("Share", "Float", "0: the first lamp; 1: the second one")

# Up to this many lamps and sources each are answered to. Two answers and a draw take more time than three answers.
ALL_UP_TO = 3
# Each lamp's p is smaller by this share than it would be as the lamp before. So no two equal lamps are the strongest.
_APART = 2.0**-20
# Distinguishes the random number from those of the random order (lobes/lobes_group.py).
_SEED = 2.0


def two_answers(tree: Tree, lights: Sequence[Light], likely: Sequence[Value]) -> list[Light]:
    """The strongest light and one drawn of the others, whose irradiance is over its probability.

    `likely` has each light's p, at least 0. Lights without shadows have a distance of 0."""
    likely = [each * (1.0 - index * _APART) for index, each in enumerate(likely)]
    most = likely[0]
    for each in likely[1:]:
        most = tree.maximum(most, each)
    packs: list[_Pack] = [
        (
            light.direction,
            light.irradiance,
            tree.vector(light.variance, light.casts_shadow * light.distance, each),
            0.0 if light.spectrum is None else light.spectrum,
        )
        for light, each in zip(lights, likely, strict=True)
    ]
    coloured = any(light.spectrum is not None for light in lights)
    weaker = [tree.math("LESS_THAN", each, most) for each in likely]
    strongest = packs[0]
    for pack, is_weaker in zip(packs[1:], weaker[1:], strict=True):
        strongest = _either(tree, is_weaker, pack, strongest)
    below = [likely[0] * weaker[0]]
    for each, is_weaker in zip(likely[1:], weaker[1:], strict=True):
        below.append(each.times_plus(is_weaker, below[-1]))
    place = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Position"])
    noise = tree.node("ShaderNodeTexWhiteNoise", place, _SEED, noise_dimensions="4D")
    at = tree.value(noise.outputs["Value"]) * below[-1]
    drawn = packs[-1]
    for pack, end in zip(packs[-2::-1], below[-2::-1], strict=True):
        here = tree.math("LESS_THAN", at, end)
        drawn = _either(tree, here, drawn, pack)
    chosen, p = _unpacked(tree, drawn, coloured=coloured)
    return [
        _unpacked(tree, strongest, coloured=coloured)[0],
        replace(chosen, irradiance=chosen.irradiance * tree.math("DIVIDE", below[-1], p)),
    ]


def _either(tree: Tree, share: Value, first: _Pack, second: _Pack) -> _Pack:
    """The first pack if the share is 0, the second if it is 1."""
    given: dict[str, Operand] = {_SHARE.name: share}
    given |= {each.name: value for each, value in zip((*_FIRST, *_SECOND), (*first, *second), strict=True)}
    outputs = tree.group(either_group(), given)
    direction, irradiance, numbers, spectrum = (outputs[each.name] for each in _PACK)
    return direction, irradiance, numbers, spectrum


def either_group() -> bpy.types.NodeTree:
    """The file's group that chooses between two packs, created if needed."""
    return shared_group("Either Lamp", (_SHARE, *_FIRST, *_SECOND), _PACK, build=_add_either)


def _add_either(tree: Tree) -> None:
    """The nodes of the group."""
    share, *packs = tree.inputs().values()
    *firsts, first = packs[: len(_PACK)]
    *seconds, second = packs[len(_PACK) :]
    chosen = (tree.blend(share, a, b) for a, b in zip(firsts, seconds, strict=True))
    tree.output(*chosen, tree.mix(share, first, second))


def _unpacked(tree: Tree, pack: _Pack, *, coloured: bool) -> tuple[Light, Value]:
    """The light in a pack, with its row if any is `coloured`, and its p."""
    direction, irradiance, numbers, spectrum = pack
    variance, distance, likely = (tree.value(socket) for socket in tree.node("ShaderNodeSeparateXYZ", numbers).outputs)
    casts_shadow = tree.math("GREATER_THAN", distance, 0.0)
    row = spectrum if coloured and isinstance(spectrum, Value) else None
    return Light(direction, irradiance, variance, distance, casts_shadow, spectrum=row), likely


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
    lamp, point = lamp_and_point(tree, index, linked, coloured=coloured)
    # The point has a small variance, for which table_share gives 1.
    shown = (table_share(tree, lamp) - 1.0) * lamp.is_area + 1.0
    return lamp, replace(point, irradiance=point.irradiance * shown)


def table_share(tree: Tree, light: Light) -> Value:
    """The share of a light that the table shows: 1 for a compact light, 0 for a wide one.

    The table treats each light as a round Gaussian. A closure samples a wide light's true shape, and hits it often."""
    compact, wide = _WIDE
    variance = light.variance
    if isinstance(light, WholeLamp):
        variance = variance * light.is_area.times_plus(1 / _AREA - 1, 1.0)
    node = tree.node("ShaderNodeMapRange", variance, compact, wide, 1.0, 0.0, interpolation_type="SMOOTHSTEP")
    return tree.value(node.outputs["Result"])


def left_by_table(tree: Tree, lights: Iterable[tuple[Light, Value | float]], direction: Value) -> Value | float:
    """The share of the light from a direction that is left for a closure: 1 minus the share of a lamp there that the
    table shows. A lamp with a share of 1 that the table does not show has no light at all."""
    left: Value | float = 1.0
    for light, share in lights:
        given: dict[str, Operand] = {_DIRECTION.name: direction}
        held = light.direction, light.irradiance, light.variance, share
        given |= {socket.name: value for socket, value in zip(_LIGHT, held, strict=True)}
        if isinstance(light, WholeLamp):
            shape = light.is_area, light.is_round, light.away, *light.axes
            given |= {socket.name: value for socket, value in zip(SHAPE, shape, strict=True)}
        left = left * tree.group(left_group(), given)[_LEFT.name]
    return left


def left_group() -> bpy.types.NodeTree:
    """The file's group of the light that a lamp leaves for a closure, created if needed."""
    return shared_group(_NAME, (_DIRECTION, *_LIGHT, *SHAPE), (_LEFT,), build=_add_left)


def _add_left(tree: Tree) -> None:
    """The nodes of the group."""
    direction, towards, irradiance, variance, share, *shape = tree.inputs().values()
    is_area, is_round, away, z, x, y = shape
    lamp = WholeLamp(towards, irradiance, variance, 0.0, share, is_area, is_round, away, (z, x, y))
    shines = tree.math("GREATER_THAN", tree.dot(irradiance, (1.0, 1.0, 1.0)), 0.0)
    beside = variance.times_plus(_CONE, tree.dot(towards, direction))  # above 1 within the cone
    within = tree.math("GREATER_THAN", beside, 1.0)
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
