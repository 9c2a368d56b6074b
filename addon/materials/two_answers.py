# SPDX-License-Identifier: GPL-3.0-or-later
"""Two answers in place of one for each lamp, so that a lamp more costs little.

Each lamp i has a likely light p_i, which is cheap: the light that its answer may send, roughly. The lamp with the
largest p is always answered to. Of the others one is drawn at random, with the probability q_i = p_i / sum of their p,
and its light is divided by q_i. So the mean over many samples is the light of all lamps. The noise is small, because
the strongest lamp has none and the others are drawn in proportion to about what they send.

Each lamp carries two vectors and four numbers (the variance of its disc, how far away its shadows begin, p, and its row
in the table of lamps) along two chains: one keeps the strongest, one the drawn lamp. Blender does not evaluate the last
number where nothing uses it."""

from collections.abc import Sequence
from dataclasses import replace

import bpy

from ..lamps.lamp_group import Light, shared_group
from ..nodes.builder import Operand, Tree, Value
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
# Distinguishes the random number from those of the random order (lobes/random_draw.py).
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
