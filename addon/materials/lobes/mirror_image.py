# SPDX-License-Identifier: GPL-3.0-or-later
"""The mirror image (the zero order) of a baked surface, as the colour of one glossy closure around its normal.

The closure is as rough as the skin, so Blender blurs the image by the lamp's disc and the roughness alone. Its colour
is what the zero order reflects along the mirror direction of the viewer."""

import numpy as np

from ...nodes.builder import Value
from ..atlas_nodes import mirror_gain, zero_order_at
from ..gamut_nodes import shown_rgb
from ..lamp_table_nodes import LampColours
from .seen_surface import SeenSurface


def mirror_image(
    surface: SeenSurface, normal: Value, rgb_from_xyz: np.ndarray, *, of_world: LampColours | None = None
) -> list[Value]:
    """The colour of the closure; then the colour `of_world`, if it is given."""
    tree = surface.tree
    triples = surface.layout.triples if of_world is not None else 1
    w = surface.cosine * 2.0 * surface.height_scale
    image, layout = surface.image, surface.layout
    channels = [zero_order_at(tree, image, layout, w=w, triple=triple) for triple in range(triples)]
    share = _reflected(surface, normal)
    if surface.plate.present:
        gains = (mirror_gain(tree, image, layout, way=surface.above, triple=triple) for triple in range(triples))
        passed = tree.squared(surface.plate.passed(tree, surface.above, surface.inside))
        channels = [colour.times_plus(passed, gain) for colour, gain in zip(channels, gains, strict=True)]
    colours = [shown_rgb(tree, rgb_from_xyz, channels[0])]
    if of_world is not None:
        colours.append(of_world.shown(channels))
    return [tree.blend(share, 0.0, colour) for colour in colours]


def _reflected(surface: SeenSurface, normal: Value) -> Value:
    """The reflected share without the zero order, along the mirror direction of the viewer; 0 if that is below."""
    if surface.layout.holds_reflectance:
        return surface.is_seen
    return surface.tree.fresnel(surface.ior, normal) * surface.is_seen
