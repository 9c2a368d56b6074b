# SPDX-License-Identifier: GPL-3.0-or-later
"""A hologram in a material: the node group of its pattern, from Blender's own nodes, before a Diffraction node.

The pattern's inputs take over the values and links that the Diffraction node had. Removing it gives them back. A
pattern gives a turn t in radians, a stretch s of the period and a share a of the strength at each place:

    Rotation (out) = Rotation + t,    Period Scale (out) = Period Scale * s,    Strength (out) = Strength * a

The place is (x, y) = (u, Aspect v), in which a surface keeps its shape. A cell or a shard has random numbers q from 0
to 1, from which come t = Turn (2 q - 1) and s = Spread^(2 q - 1): a stretch by a factor is as frequent as a shrink by
it. A hologram's picture is data that the pattern reads as it is in the file."""

from collections.abc import Callable, Iterable, Mapping
from math import pi, tau
from pathlib import Path

import bpy

from ....precompute.base.failure import GratingError
from ...blender import compat, stored
from ...nodes.builder import Operand, Tree, Value
from ...nodes.interface import add_interface, arrange, has_parts, has_sockets, note_parts
from ..pictures import content_of, note_content, picture_of
from .patterns import CHANGED, CRYSTAL, DOT_MATRIX, INPUTS, LABELS, OUTPUTS, SUNBURST

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


# How far to the left of a Diffraction node its hologram stands, and the hologram's UV map of it, in node editor units.
_STEP = 260


def hologram_of(node: bpy.types.Node) -> bpy.types.Node | None:
    """The node of the pattern that feeds a Diffraction node, or None."""
    for name in CHANGED:
        source = _source(node, name)
        if source is not None and source.node.type == "GROUP" and pattern_of(source.node.node_tree):
            return source.node
    return None


def put_hologram(
    node: bpy.types.Node, group: bpy.types.NodeTree, values: Mapping[str, float], *, uv_map: str = ""
) -> None:
    """Put a pattern before a Diffraction node, in place of its present one. `values` has numbers for the pattern's
    inputs. An empty `uv_map` stands for the map that renders. A link to the present pattern's Vector is kept."""
    tree, former = node.id_data, hologram_of(node)
    place = None if former is None or uv_map else _source(former, "Vector")
    at = (node.location.x - _STEP, node.location.y - _STEP)
    made = add_pattern(tree, group, at, place=place, uv_map=uv_map)
    _hand_over(CHANGED, node, made, past=former)
    for name in CHANGED:
        if name in node.inputs:
            tree.links.new(made.outputs[name], node.inputs[name])
    for name, value in values.items():
        made.inputs[name].default_value = value
    _remove_unused(former)


def add_pattern(
    tree: bpy.types.NodeTree, group: bpy.types.NodeTree, at: tuple[float, float], *,
    place: bpy.types.NodeSocket | None = None, uv_map: str = "",
) -> bpy.types.Node:  # fmt: skip
    """Add a pattern's node at a location. It follows `place`, else a UV Map node of its own."""
    made = tree.nodes.new("ShaderNodeGroup")
    made.node_tree, made.label, made.location = group, LABELS[pattern_of(group)], at
    if place is None:
        node = tree.nodes.new("ShaderNodeUVMap")
        node.uv_map, node.location = uv_map, (at[0] - _STEP, at[1])
        place = node.outputs["UV"]
    tree.links.new(place, made.inputs["Vector"])
    return made


def remove_hologram(node: bpy.types.Node) -> None:
    """Remove the pattern before a Diffraction node, which gets back its own values and links."""
    former = hologram_of(node)
    if former is None:
        return
    fed = [name for name in CHANGED if (source := _source(node, name)) is not None and source.node == former]
    for name in fed:
        node.id_data.links.remove(node.inputs[name].links[0])
    _hand_over(fed, former, node)
    _remove_unused(former)


def input_set_by_artist(node: bpy.types.Node, name: str) -> bpy.types.NodeSocket:
    """The socket that holds the artist's number for an input of a Diffraction node: the hologram's if one feeds it."""
    former, source = hologram_of(node), _source(node, name)
    if former is None or source is None or source.node != former or name not in former.inputs:
        return node.inputs[name]
    return former.inputs[name]


def _hand_over(
    names: Iterable[str], giver: bpy.types.Node, taker: bpy.types.Node, *, past: bpy.types.Node | None = None
) -> None:
    """Give the values and links of inputs to another node. Where `past` feeds the giver, its own input gives."""
    tree = giver.id_data
    for name in names:
        if name not in giver.inputs or name not in taker.inputs:  # an artist may have deleted a socket
            continue
        source = _source(giver, name)
        holder = giver
        if past is not None and source is not None and source.node == past and name in past.inputs:
            holder, source = past, _source(past, name)
        if holder.inputs[name].type == taker.inputs[name].type:  # an artist may have changed one
            taker.inputs[name].default_value = holder.inputs[name].default_value
        if source is not None:
            tree.links.new(source, taker.inputs[name])


def _source(node: bpy.types.Node, name: str) -> bpy.types.NodeSocket | None:
    """The socket that an input of a node is linked to, or None."""
    links = node.inputs[name].links if name in node.inputs else ()
    return links[0].from_socket if links else None


def _remove_unused(former: bpy.types.Node | None) -> None:
    """Remove a pattern's node, its UV Map node and its group, as far as nothing else uses them."""
    if former is None or any(socket.is_linked for socket in former.outputs):
        return
    tree, group, place = former.id_data, former.node_tree, _source(former, "Vector")
    at = None if place is None else place.node
    tree.nodes.remove(former)
    if at is not None and at.type == "UVMAP" and not at.outputs["UV"].is_linked:
        tree.nodes.remove(at)
    if group.users == 0:
        compat.remove_replaced(group)


def load_picture(path: str) -> bpy.types.Image:
    """Load a picture for a hologram, or take the one that was loaded from the same content. It is packed: Cycles may
    read other pictures at a reduced size, and the cells would have edges of wrong colours.

    Its values stay those of the file, so that a hue is the one that a paint program shows. Raises GratingError, with
    nothing loaded, if the file is missing or is no picture."""
    if not path:
        raise GratingError("", "From Picture needs a picture", "choose a file, such as a .png")
    file = Path(bpy.path.abspath(path))
    if not file.is_file():
        raise GratingError(path, "no such file", "choose a picture, such as a .png")
    content = f"hologram {content_of(file)}"
    image = picture_of(content)
    return image if image is not None else _loaded(file, content)


def _loaded(file: Path, content: str) -> bpy.types.Image:
    remedy = "choose a picture that Blender reads, such as a .png, .jpg or .exr"
    try:
        image = bpy.data.images.load(str(file), check_existing=False)
    except RuntimeError as error:
        raise GratingError(file, "not a picture that Blender reads", remedy) from error
    image.colorspace_settings.is_data = True
    image.alpha_mode = "CHANNEL_PACKED"
    if image.source != "FILE" or not all(image.size):
        bpy.data.images.remove(image)
        raise GratingError(file, "not a picture that Blender reads", remedy)
    image.pack()
    note_content(image, content)
    return image
