# SPDX-License-Identifier: GPL-3.0-or-later
"""A baked surface and the direction to its viewer, as the nodes of the World group use them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import bpy

from ....precompute.table.atlas import Layout
from ...nodes.builder import Tree, Value
from ..atlas_nodes import scattered_gain
from ..plate_nodes import Plate
from ..tangent_space import Direction

# The least cosine of a direction. At or below the horizon, the weight of a lobe is not finite.
COSINE_MIN = 1e-4


@dataclass(frozen=True)
class SeenSurface:
    """A bake in a node tree, and its viewer.

    above         the direction to the viewer, above a plate
    ior           the index of refraction of a dielectric
    height_scale  the factor of the relief's heights"""

    tree: Tree
    image: bpy.types.Image
    layout: Layout
    above: Direction
    ior: Value
    height_scale: Value

    @property
    def plate(self) -> Plate:
        """The plate over the relief."""
        return Plate(self.layout.plate_ior)

    @cached_property
    def inside(self) -> Direction:
        """The direction to the viewer, inside a plate."""
        return self.plate.inside(self.tree, self.above)

    @cached_property
    def cosine(self) -> Value:
        """The cosine of `inside`, at least COSINE_MIN."""
        return self.tree.maximum(self.inside.cosine, COSINE_MIN)

    @cached_property
    def is_seen(self) -> Value:
        """1 if the viewer is above the surface, else 0."""
        return self.tree.math("GREATER_THAN", self.above.cosine, 0.0)

    @cached_property
    def gain(self) -> Value:
        """What of the scattered light leaves the plate towards the viewer."""
        return scattered_gain(self.tree, self.image, self.layout, way=self.above)

    def scattered_out(self, light: Value, above: Direction) -> Value:
        """Scattered light from a direction, times what of it leaves the plate."""
        if not self.plate.present:
            return light
        gain = scattered_gain(self.tree, self.image, self.layout, way=above)
        return light * self.tree.math("MULTIPLY", gain, self.gain)
