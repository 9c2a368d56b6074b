# SPDX-License-Identifier: GPL-3.0-or-later
"""Skin materials of two species without diffraction, for the tissue under the thin diffracting layer.

They read the attributes (shape.py) and the UV map of the snake's mesh, and need no files. They have no specular
reflection: the diffraction provides it, which an artist adds with *Add to Materials*. CC0."""

from __future__ import annotations

import bpy

from ..blender import compat
from ..nodes.builder import Tree, Value
from ..nodes.interface import arrange

_Colour = tuple[float, float, float]


def give_skin(mesh: bpy.types.Mesh, species: str) -> None:
    """Give a snake's mesh its materials: the skin, then the eyes."""
    for material in (new_skin(species), new_eye(species)):
        mesh.materials.append(material)


def new_skin(species_name: str) -> bpy.types.Material:
    """A new skin material of a species in SPECIES."""
    name, colour = _SKINS[species_name]
    return _material(name, lambda tree: (colour(tree), 0.0, 0.5))


def new_eye(species_name: str) -> bpy.types.Material:
    """A new material of a wet eye: a black pupil in an iris, under a clear scale."""
    material = _material("Snake Eye", lambda tree: (_eye(tree, _IRISES[species_name]), 0.5, 0.3))
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Coat Weight"].default_value, shader.inputs["Coat Roughness"].default_value = 1.0, 0.02
    return material


def _eye(tree: Tree, iris: _Colour) -> Value:
    """A round pupil, 34 degrees in radius, in an iris that ends in a dark ring at 62 degrees."""
    skin = _Skin(tree)
    ring = skin.step(skin.gaze, 0.47, 0.55) - skin.step(skin.gaze, 0.81, 0.85)
    return skin.blend(ring, (0.003, 0.002, 0.002), iris)


def new_shed() -> bpy.types.Material:
    """A new material of thin, pale, dry, translucent skin."""
    material = _material("Shed Skin", lambda tree: (_shed(tree), 0.0, 0.6))
    tree = Tree(material.node_tree)
    (output,) = (node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL")
    skin = tree.value(output.inputs["Surface"].links[0].from_socket)
    clear = tree.value(tree.node("ShaderNodeBsdfTransparent").outputs[0])
    tree.feed(output.inputs["Surface"], tree.mix_shader(_Skin(tree).rim * 0.35 + 0.3, clear, skin))
    arrange(material.node_tree)
    return material


def _shed(tree: Tree) -> Value:
    skin = _Skin(tree)
    return skin.blend(skin.random, (0.50, 0.43, 0.33), (0.64, 0.57, 0.46))


def _material(name: str, look) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    compat.enable_nodes(material)
    material.node_tree.nodes.clear()
    tree = Tree(material.node_tree)
    colour, specular, roughness = look(tree)
    shader = tree.node("ShaderNodeBsdfPrincipled", label=name)
    for socket, value in (
        ("Base Color", colour), ("Specular IOR Level", specular), ("Roughness", roughness)
    ):  # fmt: skip
        tree.feed(shader.inputs[socket], (*value, 1.0) if isinstance(value, tuple) else value)
    tree.node("ShaderNodeOutputMaterial", tree.value(shader.outputs[0]))
    arrange(material.node_tree)
    return material


class _Skin:
    """The mesh attributes that a skin's nodes read."""

    def __init__(self, tree: Tree) -> None:
        self.tree = tree
        self.rim, self.around, self.belly, self.random, self.lip, self.gaze = (
            tree.value(tree.node("ShaderNodeAttribute", attribute_name=name, label=name).outputs["Fac"])
            for name in ("scale_rim", "around", "belly", "scale_random", "lip", "gaze")
        )

    def noise(self, scale: float, detail: float = 2.0) -> Value:
        """Noise of about 0 to 1 over the UV map, `scale` periods per girth."""
        uv = self.tree.value(self.tree.node("ShaderNodeUVMap").outputs["UV"])
        node = self.tree.node("ShaderNodeTexNoise", uv)
        self.tree.feed(node.inputs["Scale"], scale)
        self.tree.feed(node.inputs["Detail"], detail)
        return self.tree.value(node.outputs["Fac"])

    def blend(self, share: Value, low: _Colour | Value, high: _Colour | Value) -> Value:
        """Mix two colours; a share of 0 gives `low`."""
        mix = self.tree.node("ShaderNodeMix", data_type="RGBA", blend_type="MIX")
        sockets = [socket for socket in mix.inputs if socket.enabled]
        for socket, value in zip(sockets, (share, low, high), strict=True):
            self.tree.feed(socket, (*value, 1.0) if isinstance(value, tuple) else value)
        return self.tree.value(next(socket for socket in mix.outputs if socket.enabled))

    def step(self, value: Value, begin: float, end: float) -> Value:
        """A smooth step: 0 up to `begin`, 1 from `end` on."""
        node = self.tree.node("ShaderNodeMapRange", value, begin, end, 0.0, 1.0, interpolation_type="SMOOTHSTEP")
        return self.tree.value(node.outputs["Result"])


def _xenopeltis(tree: Tree) -> Value:
    """Dark red-brown plates, redder and lighter down the sides, with thin rims that are grey on the back and pale on
    the sides, in places worn away; a white belly."""
    skin = _Skin(tree)
    side = skin.step(skin.around, 0.15, 0.55)
    plate = skin.blend(side, (0.0300, 0.0140, 0.0104), (0.0580, 0.0272, 0.0188))
    plate = plate * (skin.random * 0.5 + 0.75) * (skin.noise(9.0) * 0.9 + 0.55)
    pale = skin.step(skin.around + skin.random * 0.10, 0.57, 0.66)
    plate = skin.blend(pale, plate, (0.60, 0.53, 0.44))
    rim = skin.blend(side, (0.086, 0.055, 0.044), (0.43, 0.315, 0.235))
    worn = skin.step(skin.noise(4.0) * 0.5 + skin.noise(70.0, detail=3.0) * 0.5, 0.42, 0.60)
    coat = skin.blend(skin.step(skin.rim, 0.53, 0.95) * (worn * 0.7 + 0.1), plate, rim)
    coat = skin.blend(skin.lip * skin.rim * 2.0, coat, (0.60, 0.53, 0.44))
    return skin.blend(skin.belly, coat, (0.62, 0.57, 0.50))


def _elaphe(tree: Tree) -> Value:
    """Orange brown with dark-rimmed red-brown saddles, smaller ones along the sides, and dark checks on a pale belly.
    Outlines follow the scales, because each scale has one colour."""
    skin = _Skin(tree)
    uv = tree.value(tree.node("ShaderNodeUVMap").outputs["UV"])
    u = tree.value(tree.node("ShaderNodeSeparateXYZ", uv).outputs["X"])
    along = u * 1.7 + skin.noise(1.6) * 0.5 + skin.random * 0.05
    back = _blotch(tree, along, skin.around, half_length=0.31, half_width=0.27)
    beside = tree.math("ABSOLUTE", skin.around - 0.50)
    side = _blotch(tree, along + 0.5, beside, half_length=0.22, half_width=0.10)
    inside = tree.maximum(back, side) + skin.random * 0.10 + skin.noise(5.0) * 0.5 - 0.30
    ground = skin.blend(skin.step(skin.around, 0.1, 0.7), (0.22, 0.065, 0.012), (0.26, 0.105, 0.030))
    ground = skin.blend(skin.step(skin.noise(1.1), 0.4, 0.65), ground, (0.20, 0.090, 0.032))
    ground = ground * (skin.noise(14.0) * 0.9 + 0.55) * (skin.random * 0.4 + 0.8)
    blotch = (skin.random * 0.4 + 0.8) * skin.blend(skin.noise(6.0), (0.062, 0.006, 0.003), (0.120, 0.014, 0.006))
    coat = skin.blend(skin.step(inside, 0.0, 0.03), ground, (0.009, 0.005, 0.004))
    coat = skin.blend(skin.step(inside, 0.14, 0.18), coat, blotch)
    coat = skin.blend(skin.rim * 0.4, coat, (0.085, 0.045, 0.025))
    # Dark bars between the plates of the lips.
    coat = skin.blend(skin.lip * skin.rim * 2.0, coat, (0.03, 0.02, 0.015))
    # The pale lips are seen between their plates.
    coat = skin.blend(skin.lip * (1.0 - skin.rim * 1.8) * (skin.random * 0.25 + 0.72), coat, (0.46, 0.36, 0.24))
    # Four in ten belly plates are dark except in their middle. The throat is plain.
    check = tree.math("LESS_THAN", skin.random, 0.4) * tree.math("LESS_THAN", skin.around, 0.93)
    check = check * tree.math("GREATER_THAN", u, 0.55)
    under = skin.blend(check, (0.50, 0.44, 0.35), (0.03, 0.026, 0.022))
    return skin.blend(skin.belly, coat, under)


def _blotch(tree: Tree, along: Value, across: Value, *, half_length: float, half_width: float) -> Value:
    """The signed distance inside a row of saddles, one for each whole number of `along`: 1 in the centre, 0 on the rim,
    negative outside. They are rounded rectangles, between an ellipse and a box."""
    x = (tree.math("FRACT", along) - 0.5) * (1 / half_length)
    y = across * (1 / half_width)
    x, y = x * x, y * y
    return 1.0 - tree.sqrt(tree.sqrt(x * x + y * y))


_IRISES = {"XENOPELTIS": (0.022, 0.014, 0.010), "ELAPHE": (0.42, 0.13, 0.022)}
_SKINS = {"XENOPELTIS": ("Xenopeltis Skin", _xenopeltis), "ELAPHE": ("Elaphe Skin", _elaphe)}
