# SPDX-License-Identifier: GPL-3.0-or-later
"""The mirror image (the zero order) of a baked surface, as the colour of one glossy closure around its normal.

The closure is as rough as the skin, so Blender blurs the image by the lamp's disc and the roughness alone. Its colour
is what the zero order reflects along the mirror direction of the viewer."""

import numpy as np

from ...nodes.builder import Value
from ..atlas_nodes import zero_order_at
from ..gamut_nodes import shown_rgb
from ..lamp_table_nodes import LampColours
from ..tangent_space import Direction
from .seen_surface import SeenSurface


def mirror_image(
    surface: SeenSurface, normal: Value, rgb_from_xyz: np.ndarray, *, of_world: LampColours | None = None
) -> list[Value]:
    """The colour of the closure; then the colour `of_world`, if it is given."""
    tree = surface.tree
    triples = surface.layout.triples if of_world is not None else 1
    w = surface.cosine * 2.0 * surface.height_scale
    channels = [zero_order_at(tree, surface.image, surface.layout, w=w, triple=triple) for triple in range(triples)]
    colours = [shown_rgb(tree, rgb_from_xyz, channels[0])]
    if of_world is not None:
        colours.append(of_world.shown(channels))
    share = _reflected(surface, normal)
    return [tree.blend(share, 0.0, colour) for colour in colours]


def _reflected(surface: SeenSurface, normal: Value) -> Value:
    """The reflected share without the zero order, along the mirror direction of the viewer; 0 if that is below."""
    if not surface.layout.holds_reflectance:
        return surface.tree.fresnel(surface.ior, normal) * surface.is_seen
    above, inside = (Direction(way.x * -1.0, way.y * -1.0, way.cosine) for way in (surface.above, surface.inside))
    return surface.through_plate(surface.is_seen, above, inside)
