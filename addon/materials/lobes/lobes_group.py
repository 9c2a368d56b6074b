# SPDX-License-Identifier: GPL-3.0-or-later
"""The World node group: glossy closures for light from unknown directions on a baked surface.

| socket            | symbol | default | meaning |
|-------------------|--------|---------|---------|
| Normal, Tangent   | N, T   |         | as in the Direct group (direct/direct_group.py), as are the settings |
| Mirror (out)      |        |         | colour of a closure around N: the zero order |
| Mirror Roughness (out) |   |         | of that closure |
| Lobe (out)        |        |         | colour of a closure around Lobe Normal: one order of the scattered light |
| Lobe Normal (out) |        |         | (wi + wr) / 2; closures use its direction only |
| Lobe Roughness (out) |     |         | of that closure |
| Lobe Direction (out) | wi  |         | the direction that the order comes from, unit |

A glossy closure reflects its colour at any roughness and any tilt of its normal. So the mean over many draws is the
scattered light, if each draw has the colour

    C = D c^2 G W(q; c w / lambda) / lambda^2 rgb(u, v, w) / (X + Y + Z)(u, v, w)

G is 4 cos(ti) cos(tr) Q. For a table that holds its matter's reflectance, Q is multiplied by R / F: R is the matter's
reflectance at the drawn wavelength and the half angle, F Fresnel's at the layout's ratio_ior, as is Q. The
table's colour below has no brightness, so the table's own R does not count.
The frequency q is drawn from the sample set (precompute/table/sample_set.py), which also gives its weight W. The
wavelength lambda is drawn in proportion to the observer's X + Y + Z, whose integral is D
(precompute/colour/drawn_wavelengths.py). They determine the direction wi: its tangential part is lambda q / p minus the
view's. The colour of a single wavelength would be out of gamut and different in each draw. So a draw shows the table's
colour in its direction, the mean over all wavelengths from there. The other symbols are defined in
direct/direct_group.py.

Under a plate, C has the directions inside, and is multiplied by what leaves the plate, g(wi) g(wr)
(precompute/table/plate_gains.py). An order that the front face reflects totally is black. The closure is around the
directions above the plate.

The closure of an order combines the width of the coherence kernel, with the standard deviation sigma_b in (u, v), and
the skin's roughness r: alpha^2 = 2 sigma_b^2 / w^2 + r^4. This is exact for a Beckmann lobe. The bins of the spectrum
may already include a part of the kernel (blur_q), which is subtracted here. If Sharp is 1, the kernel moves the
direction at random instead, and the closure is a perfect mirror. The place where the colour is read moves in both
cases, so that the colours of many draws add up correctly. A wide closure cannot tell in which of its directions the
light is, so with it the kernel blurs the colours twice."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ....precompute.colour.drawn_wavelengths import drawn_weight
from ....precompute.table.atlas import Layout
from ...nodes.arrange import arrange
from ...nodes.builder import Tree, Value
from ...nodes.interface import add_interface
from ..atlas_nodes import AtlasTable
from ..gamut_nodes import shown_rgb
from ..lamp_table_nodes import LampColours
from ..plate_nodes import FACE_ROUGHNESS
from ..response import SPECTRAL_WORLD_ANSWER, SPECTRUM, WORLD_ANSWER, WORLD_QUESTION
from ..small_slope_nodes import dielectric_ior, small_slope_over_fresnel, small_slope_reflectance
from ..tangent_space import Direction
from .mirror_image import mirror_image
from .random_draw import Draw, SampleSetNodes
from .seen_surface import COSINE_MIN, SeenSurface

GROUP_PREFIX = "Diffraction World"
# The least X + Y + Z of the table relative to its scale, to avoid a division by 0.
_SUM_MIN = 1e-9
# How much larger a component may be, over the world's own, than under daylight: a single hue of blue light under 2000 K
# is brighter beside the little blue of the lamp itself.
_OF_WORLD = 4.0


def build_world_group(
    name: str, image: bpy.types.Image, layout: Layout, *, draws: SampleSetNodes, rgb_from_xyz: np.ndarray,
    lamp_table: bpy.types.Image | None = None,
) -> bpy.types.NodeTree:  # fmt: skip
    """The World group of one bake, from its atlas and its sample set. rgb_from_xyz (3, 3) gives the scene's RGB.
    `lamp_table` (lamp_table_nodes.py) is for a bake with more channels than XYZ."""
    group = bpy.data.node_groups.new(f"{GROUP_PREFIX} {name}", "ShaderNodeTree")
    if lamp_table is None:
        add_interface(group, WORLD_QUESTION, WORLD_ANSWER)
    else:
        add_interface(group, (*WORLD_QUESTION, SPECTRUM), SPECTRAL_WORLD_ANSWER)
    tree = Tree(group)
    asked = tree.inputs()
    n, t, sharp, roughness, ior, period_scale, height_scale = (asked[each.name] for each in WORLD_QUESTION)
    b = tree.cross(n, t)
    geometry = tree.node("ShaderNodeNewGeometry")
    wr = tree.value(geometry.outputs["Incoming"])
    if not layout.holds_reflectance:
        ior = dielectric_ior(tree, ior)
    surface = SeenSurface(tree, image, layout, Direction.seen_in(tree, wr, (t, b, n)), ior, height_scale)
    colours = None
    if lamp_table is not None:
        colours = LampColours(tree, lamp_table, asked[SPECTRUM.name], layout.triples)
    mirrored, *mirrored_of_world = mirror_image(surface, n, rgb_from_xyz, of_world=colours)

    draw = draws.add_to(tree, tree.value(geometry.outputs["Position"]))
    variance = _variance(tree, draw, layout.sigma_b, draws.layout.blur)
    deviation = tree.sqrt(variance) if isinstance(variance, Value) else variance**0.5
    moved = [each * deviation for each in draw.normals]
    u, v = (q.times_plus(draw.wavelength, each) for q, each in zip(draw.q, moved, strict=True))
    # A stretched relief has lower frequencies. The tangential part of wi + wr, inside a plate.
    across, along = (
        tree.math("DIVIDE", q.times_plus(draw.wavelength, each * sharp), period_scale)
        for q, each in zip(draw.q, moved, strict=True)
    )
    order = _Order.of(surface, across, along)
    # The constant factors of all draws: D, the weights' scale, and the 4 of G.
    scale = drawn_weight(layout.illuminant) * draws.layout.scale * 4.0
    table = _Looked(surface, scale, uv=(u, v), w=order.w)
    inverse = tree.math("DIVIDE", height_scale, draw.wavelength)
    gain = tree.squared(inverse) * draw.weight(order.w * inverse) * _gain(surface, order, draw)
    gain = tree.maximum(gain, 0.0)
    lobe = tree.blend(gain, 0.0, table.colour(rgb_from_xyz))
    of_world = mirrored_of_world
    if colours is not None:
        of_world = [*mirrored_of_world, tree.blend(gain, 0.0, table.colour_of_world(colours, rgb_from_xyz))]

    alpha2 = tree.math("DIVIDE", variance * (2 * layout.plate_ior**2), tree.squared(order.sum_above[2]))
    alpha2 = tree.minimum(alpha2 + tree.squared(tree.squared(roughness)), 1.0)
    lobe_roughness = tree.sqrt(tree.sqrt(alpha2)) * (1.0 - sharp)
    half_way = order.half_way(surface, (t, b, n))
    to_light = tree.blend(2.0, wr, half_way)
    at_least = tree.maximum(roughness, FACE_ROUGHNESS) if surface.plate.present else roughness
    tree.output(mirrored, at_least, lobe, half_way, lobe_roughness, to_light, *of_world)
    arrange(group)
    return group


@dataclass(frozen=True)
class _Order:
    """A drawn order: the direction that its light comes from.

    inside, above  the direction inside a plate, and above it
    w              the component of wi + wr along the normal, inside
    half2          1 + wi.wr, inside
    sum_above      the components of wi + wr along T, B and N, above
    is_real        1 if there is such a direction and the surface is seen, else 0"""

    inside: Direction
    above: Direction
    w: Value
    half2: Value
    sum_above: tuple[Value, Value, Value]
    is_real: Value

    @classmethod
    def of(cls, surface: SeenSurface, across: Value, along: Value) -> _Order:
        """The order with these components of wi + wr along T and B, inside a plate."""
        tree, plate = surface.tree, surface.plate
        x, y = across - surface.inside.x, along - surface.inside.y
        cosine2 = 1.0 - y.times_plus(y, x * x)
        cosine = tree.sqrt(tree.maximum(cosine2, COSINE_MIN**2))
        w = cosine + surface.cosine
        half2 = w.times_plus(w, across.times_plus(across, along * along)) * 0.5
        inside = above = Direction(x, y, cosine)
        sum_above = across, along, w
        if plate.present:
            cosine2, above, view = plate.cosine2_above(tree, inside), plate.above(tree, inside), surface.above
            sum_above = above.x + view.x, above.y + view.y, above.cosine + view.cosine
        is_real = tree.math("GREATER_THAN", cosine2, COSINE_MIN**2) * surface.is_seen
        return cls(inside, above, w, half2, sum_above, is_real)

    def half_way(self, surface: SeenSurface, frame: tuple[Value, Value, Value]) -> Value:
        """(wi + wr) / 2 in world space above a plate, given the axes (T, B, N)."""
        tree = surface.tree
        x, y, z = self.sum_above
        parts = [tree.blend(each, 0.0, axis) for each, axis in zip((x * 2.0, y * 2.0, z), frame, strict=True)]
        return tree.blend(0.5, tree.blend(0.5, *parts[:2]), parts[2])


def _variance(tree: Tree, draw: Draw, sigma_b: float, blur: float) -> Value | float:
    """The variance in (u, v) of the part of the kernel that the sample set lacks at the drawn wavelength."""
    if blur == 0:
        return sigma_b**2
    return tree.maximum(tree.squared(draw.wavelength).times_plus(-(blur**2), sigma_b**2), 0.0)


class _Looked:
    """The table at a place of an order. Its colours have X + Y + Z = scale under daylight, and are black outside of the
    table."""

    def __init__(self, surface: SeenSurface, scale: float, *, uv: tuple[Value, Value], w: Value):
        self.tree, self.layout, self.scale = surface.tree, surface.layout, scale
        self.table = AtlasTable(self.tree, surface.image, self.layout, uv=uv, w=w * surface.height_scale)
        self.xyz = self.table.read(self.table.sharp)
        total = self.tree.maximum(self.tree.dot(self.xyz, (1.0, 1.0, 1.0)), _SUM_MIN)
        self.share = self.tree.math("DIVIDE", self.table.inside * scale, total)

    def colour(self, rgb_from_xyz: np.ndarray) -> Value:
        """The colour under daylight."""
        return self._limited(shown_rgb(self.tree, rgb_from_xyz, self.xyz), rgb_from_xyz, 1.0)

    def colour_of_world(self, colours: LampColours, rgb_from_xyz: np.ndarray) -> Value:
        """The colour under a world, over that of the world."""
        others = [self.table.read(self.table.sharp, triple) for triple in range(1, self.layout.triples)]
        return self._limited(colours.shown([self.xyz, *others]), rgb_from_xyz, _OF_WORLD)

    def _limited(self, rgb: Value, rgb_from_xyz: np.ndarray, more: float) -> Value:
        """No light has a larger component than the most saturated colour. Rounding errors of the table in the dark
        may."""
        red, green, blue = (float(row.max()) * self.scale * more for row in rgb_from_xyz)
        return self.tree.vector_math("MINIMUM", rgb * self.share, (red, green, blue))


def _gain(surface: SeenSurface, order: _Order, draw: Draw) -> Value:
    """G for a drawn order, without its 4, times what a plate's front face lets through."""
    tree, light, view = surface.tree, order.inside, surface.inside
    if surface.layout.holds_reflectance:
        # |wi + wr| / 2 is the cosine of the half angle.
        matter = draw.reflectance(tree.sqrt(order.half2 * 0.5))
        ratio_ior = surface.layout.ratio_ior
        gain = small_slope_over_fresnel(tree, ratio_ior, light=light, view=view, one_plus=order.half2) * matter
    else:
        gain = small_slope_reflectance(tree, surface.ior, light=light, view=view, one_plus=order.half2)
    return surface.scattered_out(gain * (light.cosine * surface.cosine) * order.is_real, order.above)
