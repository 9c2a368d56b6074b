# SPDX-License-Identifier: GPL-3.0-or-later
"""The matter of a response, held by custom properties of its node group in saved files: how a smooth surface of it
reflects, whether the base is seen through it, and a transparent plate over the relief (precompute/optics/plate.py), as
nodes."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...precompute.optics.plate import NO_PLATE, PLATE_IOR_MAX
from ...precompute.reflectance.matter import Matter
from ..blender import stored
from ..blender.working_space import working_space
from ..nodes.builder import Tree, Value, by_group
from .atlas_nodes import Direction

# The roughness of the plate's front face, and the least one of the mirror image under it. Cycles takes a perfect mirror
# for a lobe of a certain width, so beside a nearly perfect mirror its share is wrong.
FACE_ROUGHNESS = 0.02


@dataclass(frozen=True)
class Plate:
    """A plate with an index of refraction. The index 1 stands for no plate, which adds no nodes."""

    ior: float

    @property
    def present(self) -> bool:
        """Whether there is a plate."""
        return self.ior != NO_PLATE

    def inside(self, tree: Tree, direction: Direction) -> Direction:
        """The direction inside of light that has a direction above the plate."""
        if not self.present:
            return direction
        x, y = direction.x * (1 / self.ior), direction.y * (1 / self.ior)
        # cos(t')^2 = 1 - (1 - cos(t)^2) / n^2
        cosine = tree.sqrt(tree.squared(direction.cosine).times_plus(self.ior**-2, 1 - self.ior**-2))
        return Direction(x, y, cosine)

    def above(self, tree: Tree, direction: Direction) -> Direction:
        """The direction above the plate of light that has a direction inside. At most grazing, past which the front
        face reflects it back."""
        if not self.present:
            return direction
        x, y = direction.x * self.ior, direction.y * self.ior
        cosine = tree.sqrt(tree.maximum(self.cosine2_above(tree, direction), 0.0))
        return Direction(x, y, cosine)

    def cosine2_above(self, tree: Tree, direction: Direction) -> Value:
        """The squared cosine above the plate of light with a direction inside; below 0 for light that cannot leave."""
        return tree.squared(direction.cosine).times_plus(self.ior**2, 1 - self.ior**2)

    def refracted(self, above: Direction, inside: Direction) -> Value:
        """cos(ti) / (n^2 cos(ti')) of the direction to the light."""
        return above.cosine / inside.cosine * self.ior**-2

    def passed(self, tree: Tree, above: Direction, inside: Direction) -> Value:
        """What the front face lets through, T, on the way between a direction above and the one inside."""

        def formula(inner: Tree, above: Value, inside: Value) -> tuple[Value]:
            across = _squared_ratio(inner, above, inside * self.ior)
            within = _squared_ratio(inner, above * self.ior, inside)
            return ((across + within).times_plus(-0.5, 1.0),)

        given = {"above": above.cosine, "inside": inside.cosine}
        return by_group(tree, "Through Plate", formula, given=given, gives={"passed": "Float"}, of=f"{self.ior}")[0]

    def face(self, tree: Tree, normal: Value, share: Value) -> Value:
        """The closure of a share of the front face, which mirrors by Fresnel's formula."""
        return tree.glossy(tree.fresnel(self.ior, normal) * share, FACE_ROUGHNESS, normal)


def _squared_ratio(tree: Tree, a: Value, b: Value) -> Value:
    """((a - b) / (a + b))^2 of two numbers of at least 0."""
    return tree.squared(tree.math("DIVIDE", a - b, tree.maximum(a + b, 1e-6)))


# Whether nothing is seen through the matter, the index of refraction of the plate over the relief, and the colours of a
# smooth surface at _COSINES. A dielectric has no such colours.
_OPAQUE, _PLATE, _COLOURS = "ng_opaque", "ng_plate", "ng_smooth"
# The cosines of a curve's stops, closer where it is steep. Blender's Color Ramp has at most 32 stops, and a table of
# 256 colours. Both together err by less than 0.01, except at the sharp edges of stacks of more than 20 layers (0.02).
_COSINES = np.linspace(0, 1, 32) ** 2


def note_matter(group: bpy.types.NodeTree, matter: Matter, illuminant: str) -> None:
    """Store the matter of a response on its node group."""
    if matter.opaque:
        group[_OPAQUE] = True
    if matter.has_plate:
        group[_PLATE] = matter.plate_ior
    if matter.baked:
        from ...precompute.colour.spaces import smooth_colour  # a dielectric does not need it

        colours = smooth_colour(matter, _COSINES, space=working_space(), illuminant=illuminant)
        group[_COLOURS] = colours.ravel().tolist()


def is_opaque(group: bpy.types.NodeTree) -> bool:
    """Whether nothing is seen through a response's matter, as on a metal."""
    return bool(stored.count(group, _OPAQUE, 1))


def plate_of(group: bpy.types.NodeTree) -> Plate:
    """The plate over a response's relief. Its index is 1 if the relief has no plate."""
    return Plate(stored.number(group, _PLATE, NO_PLATE, low=NO_PLATE, high=PLATE_IOR_MAX))


def smooth_reflectance(tree: Tree, group: bpy.types.NodeTree, cosine: Value) -> tuple[Value, Value] | None:
    """Add nodes for what a smooth surface of a response's matter reflects towards the viewer: its colour and its
    luminance. None if this follows the index of refraction in the scene. `cosine` is of the angle to the viewer, on
    either side."""
    colours = stored.numbers(group, _COLOURS, 4 * len(_COSINES))
    if colours is None:
        return None
    node = tree.node("ShaderNodeValToRGB", tree.math("ABSOLUTE", cosine), label="Smooth Surface")
    stops = node.color_ramp.elements
    stops.remove(stops[1])
    for position, colour in zip(_COSINES.tolist(), np.reshape(colours, (-1, 4)), strict=True):
        stop = stops.new(position) if position else stops[0]
        stop.color = colour
    return tree.value(node.outputs["Color"]), tree.value(node.outputs["Alpha"])
