# SPDX-License-Identifier: GPL-3.0-or-later
"""The patterns of holograms as node groups of Blender's own nodes.

A pattern gives a turn t in radians, a stretch s of the period and a share a of the strength at each place:

    Rotation (out) = Rotation + t,    Period Scale (out) = Period Scale * s,    Strength (out) = Strength * a

The place is (x, y) = (u, Aspect v), in which a surface keeps its shape. A cell or a shard has random numbers q from 0
to 1, from which come t = Turn (2 q - 1) and s = Spread^(2 q - 1): a stretch by a factor is as frequent as a shrink by
it."""

from collections.abc import Callable
from math import pi, tau

import bpy

from ...blender import stored
from ...nodes.arrange import arrange
from ...nodes.builder import Operand, Tree, Value
from ...nodes.interface import add_interface, has_sockets
from ...nodes.node_count import has_parts, note_parts
from .patterns import CRYSTAL, DOT_MATRIX, INPUTS, LABELS, OUTPUTS, SUNBURST

# Custom property of a pattern's node group, saved in files: its identifier.
_PATTERN = "ng_hologram"
# The exponent from the values of a picture file to light, about that of sRGB.
_GAMMA = 2.2
# How far a seed moves the shards. Shards that far apart are independent, and the numbers stay exact to 1/1000 shard.
_SEED_STEP = (7.31, 3.17, 0.0)

_Inputs = dict[str, Value]
_Changes = tuple[Operand, Operand, Operand]


def pattern_group(pattern: str, image: bpy.types.Image | None = None) -> bpy.types.NodeTree:
    """The node group of a pattern, from the file if it holds an intact one. `image` is the picture of PICTURE."""
    for group in bpy.data.node_groups:
        if group.library is None and pattern_of(group) == pattern and _is_intact(group, pattern, image):
            return group
    group = bpy.data.node_groups.new(f"Hologram {LABELS[pattern]}", "ShaderNodeTree")
    add_interface(group, INPUTS[pattern], OUTPUTS)
    tree = Tree(group)
    inputs = tree.inputs()
    place = inputs["Vector"] * tree.vector(1.0, inputs["Aspect"], 0.0)
    changes = _BUILDERS[pattern](tree, inputs, place) if image is None else _from_picture(tree, inputs, place, image)
    turn, stretch, share = changes
    tree.output(inputs["Rotation"] + turn, inputs["Period Scale"] * stretch, inputs["Strength"] * share)
    arrange(group)
    note_parts(group)
    group[_PATTERN] = pattern
    return group


def pattern_of(group: bpy.types.NodeTree | None) -> str:
    """The identifier of the pattern that a node group makes; empty for other node groups."""
    return "" if group is None else stored.choice(group.get(_PATTERN), tuple(INPUTS), "")


def _is_intact(group: bpy.types.NodeTree, pattern: str, image: bpy.types.Image | None) -> bool:
    pictures = [node.image for node in group.nodes if node.type == "TEX_IMAGE"]
    return has_sockets(group, INPUTS[pattern], OUTPUTS) and has_parts(group) and pictures == ([image] if image else [])


def _dot_matrix(tree: Tree, inputs: _Inputs, place: Value) -> _Changes:
    """Square cells with random numbers."""
    return _random_changes(inputs, _noise(tree, _cell(tree, place, inputs["Cells"]), inputs["Seed"]))


def _sunburst(tree: Tree, inputs: _Inputs, place: Value) -> _Changes:
    """The angle around a centre; in sectors, that of the sector's middle."""
    centre = tree.vector(inputs["Center X"], inputs["Center Y"] * inputs["Aspect"], 0.0)
    x, y, _ = _parts(tree, place - centre)
    turns = tree.math("FRACT", tree.math("ARCTAN2", y, x) * (1 / tau))
    sectors = tree.math("ROUND", inputs["Sectors"])
    has_sectors = tree.math("GREATER_THAN", sectors, 0.5)
    number = tree.math("FLOOR", turns * sectors) + 0.5
    in_sector = number / tree.maximum(sectors, 1.0)
    random = _noise(tree, tree.vector(number, 0.0, 0.0), inputs["Seed"])
    stretch = _stretch(inputs, (random[1] - 0.5) * has_sectors + 0.5)
    return tree.mix(has_sectors, turns, in_sector) * tau + inputs["Twist"], stretch, 1.0


def _crystal(tree: Tree, inputs: _Inputs, place: Value) -> _Changes:
    """Voronoi cells with random numbers."""
    node = tree.node("ShaderNodeTexVoronoi", voronoi_dimensions="2D", feature="F1", distance="EUCLIDEAN")
    tree.feed(node.inputs["Vector"], place * inputs["Shards"] + inputs["Seed"] * _SEED_STEP)
    tree.feed(node.inputs["Scale"], 1.0)
    tree.feed(node.inputs["Randomness"], inputs["Randomness"])
    return _random_changes(inputs, _parts(tree, tree.value(node.outputs["Color"])))


def _from_picture(tree: Tree, inputs: _Inputs, place: Value, image: bpy.types.Image) -> _Changes:
    """A picture's hue as half a turn, its saturation as a stretch, and its brightness as a share of the strength."""
    cells = inputs["Cells"]
    has_cells = tree.math("GREATER_THAN", cells, 0.5)
    in_cell = _cell(tree, place, cells) * (1.0 / tree.maximum(cells, 1e-6))
    uv = tree.mix(has_cells, place, in_cell) / tree.vector(1.0, inputs["Aspect"], 1.0)
    # Cubic for both renderers to agree (Tree.image), and because EEVEE would blur the edges of cells by mip levels.
    read = tree.node("ShaderNodeTexImage", uv, image=image, interpolation="Cubic", extension="REPEAT")
    colour, alpha = (tree.value(read.outputs[name]) for name in ("Color", "Alpha"))
    hue, saturation, value = (
        tree.value(each) for each in tree.node("ShaderNodeSeparateColor", colour, mode="HSV").outputs
    )
    turn = hue * pi * tree.math("GREATER_THAN", saturation, inputs["Grey Below"])
    return turn, tree.math("POWER", inputs["Saturated Period"], saturation), tree.math("POWER", value, _GAMMA) * alpha


def _cell(tree: Tree, place: Value, cells: Value) -> Value:
    """The middle of a place's square cell, in widths of a cell."""
    return tree.vector_math("FLOOR", place * cells) + (0.5, 0.5, 0.0)


def _noise(tree: Tree, cell: Value, seed: Value) -> tuple[Value, Value, Value]:
    """Three random numbers from 0 to 1 of a cell, which must be exact numbers, and of a seed."""
    node = tree.node("ShaderNodeTexWhiteNoise", noise_dimensions="3D")
    tree.feed(node.inputs["Vector"], cell + tree.vector(0.0, 0.0, seed))
    return _parts(tree, tree.value(node.outputs["Color"]))


def _random_changes(inputs: _Inputs, random: tuple[Value, Value, Value]) -> _Changes:
    return random[0].times_plus(2.0, -1.0) * inputs["Turn"], _stretch(inputs, random[1]), 1.0


def _stretch(inputs: _Inputs, random: Value) -> Value:
    return random.tree.math("POWER", inputs["Period Spread"], random.times_plus(2.0, -1.0))


def _parts(tree: Tree, vector: Value) -> tuple[Value, Value, Value]:
    x, y, z = tree.node("ShaderNodeSeparateXYZ", vector).outputs
    return tree.value(x), tree.value(y), tree.value(z)


_BUILDERS: dict[str, Callable[[Tree, _Inputs, Value], _Changes]] = {
    DOT_MATRIX: _dot_matrix,
    SUNBURST: _sunburst,
    CRYSTAL: _crystal,
}
