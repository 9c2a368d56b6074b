# SPDX-License-Identifier: GPL-3.0-or-later
"""The Direct node group: the light of one lamp that a baked surface sends to the viewer, without noise.

| socket         | symbol | unit    | default | meaning |
|----------------|--------|---------|---------|---------|
| Normal         | N      |         |         | shading normal, unit |
| Tangent        | T      |         |         | direction of the scan's x axis, unit, orthogonal to N |
| To Light       | wi     |         |         | unit vector to the lamp |
| Irradiance     | E      | W/m2    |         | on a surface that faces the lamp |
| Variance       |        | rad2    | 0       | of the lamp's disc as seen from the point, along one axis |
| Zero Order     | z      |         | 1       | 0 removes the mirror image, for use with a closure that shows it |
| Roughness      | r      |         | 0       | of the skin over the relief: alpha = r^2, as in Blender |
| IOR            | n      |         | 1.56    | of the skin: sets the reflectance |
| Period Scale   | p      |         | 1       | stretches the relief along the surface |
| Height Scale   | c      |         | 1       | scales the relief's heights; at most 1, as the table ends at w = 2 |
| Finer, Coarser (out) | Lo | W/m2/sr |   | scattered radiance, linear RGB, at the two blur levels around the variance |
| Coarser Share (out) |  |         |         | share of Coarser in their mix |
| Mirror (out)   | Lo     | W/m2/sr |         | radiance of the mirror image (the second summand below) without z |
| Mirror Share (out) | z  |         |         | share of Mirror; 0 where there is no mirror image |
| Likely (out)   |        |         |         | about the radiance per irradiance, in units of the table's scale |

A bake with more channels than XYZ has one more input, Spectrum: the lamp's row in the table of lamps. Its outputs
"Finer of Lamp", "Coarser of Lamp" and "Mirror of Lamp" are the radiances by the lamp's own spectrum. Several bakes in
one picture (direct/layers.py) have the input Layer: the number of the one to read.

    Lo = E [ 4 cos(ti)^2 cos(tr) Q p^2 c^2 sum_k f_k(t(c w)) B_k(p u, p v) + z R Z(c w) kernel(wi, wr) ]

This is f * E * cos(ti) of a dielectric (docs/theory.md); the w^2 of its factor cancels the table's. Q is the small
slope reflectance (atlas_nodes.py), R Fresnel's. The table of a metal or a film holds its reflectance. It has Q /
R at the layout's ratio_ior (precompute/optics/brdf.py) in place of Q, and 1 in place of R. The f_k are functions of w,
stored as sums of Chebyshev polynomials. The kernel is that of the lamp's image in a mirror
(precompute/optics/mirror_image.py). Under a plate, the scattered light has the directions inside it, and is multiplied
by cos(ti) / (n^2 cos(ti')) (precompute/optics/plate.py) and by g(wi) g(wr); Z(c w) becomes T(ti) T(tr) Z(c w) + X(wr),
with the light that the plate gives back to the relief (precompute/table/plate_gains.py). B_k are read at the blur
levels (precompute/table/atlas.py) around the variance

    sigma^2 = sigma_b^2 + max(0, Variance - sigma_b^2) (1 + cos(ti)^2) / 2 + (w r^2)^2 / 2

The second term is the lamp's disc. The bake's own kernel already covers a disc of its size, so only the rest of the
disc's variance is added. Projected onto the surface, a disc keeps its width across the plane of incidence and is
shortened by cos(ti) within it; the formula takes the mean of both variances. The third term is the skin's roughness:
the slopes of a Beckmann lobe have the variance alpha^2 / 2."""

import math

import bpy
import numpy as np

from ....precompute.table.atlas import Layout
from ...nodes.builder import Tree, Value
from ...nodes.interface import add_interface, arrange
from ..atlas_nodes import (
    Atlas,
    AtlasTable,
    Direction,
    LampColours,
    dielectric_ior,
    mirror_gain,
    scattered_gain,
    shown_rgb,
    small_slope_over_fresnel,
    small_slope_reflectance,
    zero_order_at,
)
from ..matter_nodes import Plate
from ..response import LAYER, QUESTION, RADIANCES, SPECTRAL_RADIANCES, SPECTRUM, Response
from .mirror_kernel_nodes import mirror_kernel

GROUP_PREFIX = "Diffraction Direct"
# For the likely light: how much wider its kernel is, in variance. It must not be narrower anywhere, or the few samples
# that hit what it does not know would be fireflies. Then, how much of its light a zero order is taken to have.
_WIDER, _ZERO_ORDER_LIKELY = 4.0, 0.5


def build_direct_group(
    name: str, image: bpy.types.Image, layout: Layout, *, rgb_from_xyz: np.ndarray,
    lamp_table: bpy.types.Image | None = None, layers: int = 1,
) -> Response:  # fmt: skip
    """The response of one bake, or of several as layers. `image` holds the atlas; rgb_from_xyz (3, 3) converts to the
    scene's linear space. `lamp_table` (atlas_nodes.py) is for a bake with more channels than XYZ."""
    group = bpy.data.node_groups.new(f"{GROUP_PREFIX} {name}", "ShaderNodeTree")
    more = [*([LAYER] if layers > 1 else []), *([] if lamp_table is None else [SPECTRUM])]
    add_interface(group, (*QUESTION, *more), RADIANCES if lamp_table is None else SPECTRAL_RADIANCES)
    tree = Tree(group)
    asked = tree.inputs()
    atlas = Atlas(image, layout, layers, asked.get(LAYER.name))
    inputs = (asked[socket.name] for socket in QUESTION)
    n, t, wi, irradiance, disc, zero_order, roughness, ior, period_scale, height_scale = inputs

    b = tree.cross(n, t)
    wr = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Incoming"])
    plate = Plate(layout.plate_ior)
    to_light, to_view = (Direction.seen_in(tree, way, (t, b, n)) for way in (wi, wr))
    light, view = (plate.inside(tree, way) for way in (to_light, to_view))
    u, v, w = light.x + view.x, light.y + view.y, light.cosine + view.cosine
    uv2 = tree.sum_of_squares(u, v)
    half2 = w.times_plus(w, uv2)  # 2 (1 + wi.wr)

    # 0, and so a constant in Cycles, for a small lamp on a smooth skin.
    largest = tree.maximum(disc * layout.plate_ior**-2 - layout.sigma_b**2, 0.0)
    slope = w * (roughness * roughness)
    blur = largest * tree.squared(to_light.cosine).times_plus(0.5, 0.5) + slope * slope * 0.5
    table = AtlasTable(tree, atlas, uv=(u * period_scale, v * period_scale), w=w * height_scale)
    # Period Scale stretches the relief's own kernel, but not the blur by lamp and roughness.
    *places, share = table.around(blur * (period_scale * period_scale))

    reflectance = None
    if layout.holds_reflectance:
        slopes = small_slope_over_fresnel(tree, layout.ratio_ior, light=light, view=view, one_plus=half2 * 0.5)
    else:
        ior = dielectric_ior(tree, ior)
        half = wi + wr
        mirror = tree.normalize(half) if plate.present else half * tree.math("INVERSE_SQRT", half2)
        reflectance = tree.fresnel(ior, mirror)
        slopes = small_slope_reflectance(tree, ior, light=light, view=view, one_plus=half2 * 0.5)
    factor = tree.squared(light.cosine) * slopes * (view.cosine * 4.0)
    image_of_lamp = mirror_kernel(
        tree, to_light, to_view, uv2=uv2 * layout.plate_ior**2 if plate.present else uv2, variance=disc,
        roughness=roughness,
    )  # fmt: skip
    mirror_factor = image_of_lamp.value if reflectance is None else image_of_lamp.value * reflectance
    if plate.present:
        factor = factor * plate.refracted(to_light, light)
        for way in (to_light, to_view):
            factor = tree.math("MULTIPLY", factor, scattered_gain(tree, atlas, way=way))
        passed = plate.passed(tree, to_light, light) * plate.passed(tree, to_view, view)
    scattered = factor * table.inside * (tree.squared(period_scale * height_scale) * layout.scale)

    def channels(triple: int) -> list[Value]:
        """Three channels at each of the places, and of the mirror image."""
        scattered_light = [table.read(place, triple) for place in places if place is not None]
        zero_order = zero_order_at(tree, atlas, w=w * height_scale, triple=triple)
        if plate.present:
            more = mirror_gain(tree, atlas, way=to_view, triple=triple)
            zero_order = zero_order.times_plus(passed, more)
        return [*scattered_light, zero_order]

    factors = [irradiance * scattered] * sum(place is not None for place in places) + [irradiance * mirror_factor]

    def radiances(colours: list[Value]) -> list[Value]:
        """The finer radiance, the coarser one, and that of the mirror image, from their colours."""
        finer, *coarser, mirror = (colour * factor for colour, factor in zip(colours, factors, strict=True))
        return [finer, coarser[0] if coarser else finer, mirror]

    xyz = channels(0)
    finer, coarser, mirrored = radiances([shown_rgb(tree, rgb_from_xyz, each) for each in xyz])
    of_lamp: list[Value] = []
    if lamp_table is not None:
        colours = LampColours(tree, lamp_table, asked[SPECTRUM.name], layout.triples)
        others = [channels(triple) for triple in range(1, layout.triples)]
        of_lamp = radiances([colours.shown(triples) for triples in zip(xyz, *others, strict=True)])
    mirror_share = image_of_lamp.is_near * zero_order
    # Constants in Cycles for suns: the variance of a lamp at the normal, and wider than the kernel on purpose.
    wide = (largest + tree.squared(roughness * roughness) * 2.0).times_plus(_WIDER, _WIDER * layout.sigma_b**2)
    likely = table.likely(wide * (period_scale * period_scale)) * tree.maximum(light.cosine, 0.0)
    wide = image_of_lamp.spread * _WIDER
    at_mirror = wide * (_ZERO_ORDER_LIKELY / (2 * math.pi) / layout.scale) * zero_order
    likely = likely + at_mirror / tree.squared(image_of_lamp.away2 + wide)
    tree.output(finer, coarser, share, mirrored, mirror_share, likely, *of_lamp)
    arrange(group)
    return Response(group)
