# SPDX-License-Identifier: GPL-3.0-or-later
"""A transparent plate over the relief (precompute/optics/plate.py) as nodes."""

from __future__ import annotations

from dataclasses import dataclass

from ...precompute.optics.plate import NO_PLATE
from ..nodes.builder import Tree, Value
from .tangent_space import Direction

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
        across = _squared_ratio(tree, above.cosine, inside.cosine * self.ior)
        within = _squared_ratio(tree, above.cosine * self.ior, inside.cosine)
        return (across + within).times_plus(-0.5, 1.0)

    def face(self, tree: Tree, normal: Value, share: Value) -> Value:
        """The closure of a share of the front face, which mirrors by Fresnel's formula."""
        return tree.glossy(tree.fresnel(self.ior, normal) * share, FACE_ROUGHNESS, normal)


def _squared_ratio(tree: Tree, a: Value, b: Value) -> Value:
    """((a - b) / (a + b))^2 of two numbers of at least 0."""
    return tree.squared(tree.math("DIVIDE", a - b, tree.maximum(a + b, 1e-6)))
