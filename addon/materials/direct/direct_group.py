# SPDX-License-Identifier: GPL-3.0-or-later
"""The Direct node group: what a baked surface answers to one lamp, without noise.

| socket         | symbol | unit    | default | meaning |
|----------------|--------|---------|---------|---------|
| Normal         | N      |         |         | shading normal, unit |
| Tangent        | T      |         |         | direction of the scan's x axis, unit, across N  |
| To Light       | wi     |         |         | unit |
| Irradiance     | E      | W/m2    |         | on a surface that faces the lamp |
| Variance       |        | rad2    | 0       | of the lamp's disc in the sky, along one axis |
| Zero Order     | z      |         | 1       | 0 leaves the mirror image out, where a closure shows it |
| Roughness      | r      |         | 0       | of the skin over the relief: alpha = r^2, as Blender's own |
| IOR            | n      |         | 1.56    | of the skin: sets how much is reflected at all |
| Period Scale   | p      |         | 1       | stretches the relief along the surface |
| Height Scale   | c      |         | 1       | scales the relief's heights; at most 1, as the table ends at w = 2 |
| Energy Conserving | e   |         | 1       | 0 is Stam's formula, which towards grazing reflects more than arrives |
| Finer, Coarser (out) | Lo | W/m2/sr |       | radiance, linear RGB, by the two levels next to the blur |
| Coarser Share (out) |  |         |         | share of Coarser in their mix |

    Lo = E R / M [ (1 + wi.wr)^2 / cos(tr) * p^2 c^2 sum_k f_k(t(c w)) B_k(p u, p v) + z cos(ti) Z(c w) kernel(u, v) ]

    M = 1 + e max(0, X(wi) / cos(ti), X(wr) / cos(tr))

which is f * E * cos(ti) with Stam's obliquity (docs/theory.md). The w^2 in the obliquity cancels the table's. M is the
albedo bound: it keeps the surface from reflecting more than arrives. X is the excess albedo of the relief as baked
(precompute/table/albedo_bound.py). The f_k are functions of w, which the bake holds as sums of Chebyshev polynomials.
B_k are read from the blurred levels (precompute/table/atlas.py) next to the variance

    sigma^2 = sigma_b^2 + max(0, Variance (1 + cos(ti)^2) / 2 - sigma_b^2) + (w r^2)^2 / 2

The second term is the lamp's disc. The bake's own kernel already stands for a disc of its size, so only the rest of the
disc's variance is added. Seen from the surface, a disc keeps its width across the plane of incidence and has cos(ti) of
it within the plane; the mean of both variances is taken. The third term is the skin's roughness: the slopes of a
Beckmann lobe have a variance of alpha^2 / 2.
"""

import math

import bpy
import numpy as np

from ....precompute.table.atlas import Layout
from ...nodes.arrange import arrange
from ...nodes.builder import Tree, Value
from ...nodes.interface import add_interface
from ..atlas_nodes import AtlasTable, Direction, albedo_bound, excess_albedo, matrix_times, zero_order_xyz
from ..response import QUESTION, TWO_RADIANCES, Response

GROUP_PREFIX = "Diffraction Direct"


def build_direct_group(name: str, image: bpy.types.Image, layout: Layout, *, rgb_from_xyz: np.ndarray) -> Response:
    """The response of one bake. `image` holds its atlas; rgb_from_xyz (3, 3) leads to the scene's linear space."""
    group = bpy.data.node_groups.new(f"{GROUP_PREFIX} {name}", "ShaderNodeTree")
    add_interface(group, QUESTION, TWO_RADIANCES)
    tree = Tree(group)
    asked = tree.inputs()
    inputs = (asked[socket.name] for socket in QUESTION)
    n, t, wi, irradiance, disc, zero_order, roughness, ior, period_scale, height_scale, conserving = inputs

    b = tree.cross(n, t)
    wr = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Incoming"])
    light, view = (Direction.seen_in(tree, way, (t, b, n)) for way in (wi, wr))
    half = light.vector + view.vector
    w = light.cosine + view.cosine
    uv = half * (1.0, 1.0, 0.0)
    half2 = tree.dot(half, half)  # 2 (1 + wi.wr)

    slope = w * (roughness * roughness)
    disc = disc * tree.squared(light.cosine).times_plus(0.5, 0.5)
    blur = tree.maximum(disc - layout.sigma_b**2, 0.0) + slope * slope * 0.5
    table = AtlasTable(tree, image, layout, uv=uv * period_scale, w=w * height_scale)
    # The kernel belongs to the relief and is stretched with it. The blur by lamp and roughness is not.
    finer, coarser, share = table.around(blur * (period_scale * period_scale))

    obliquity = half2 * half2 / tree.maximum(view.cosine, 1e-6)
    scattered = obliquity * (tree.squared(period_scale * height_scale) * (layout.scale / 4))
    variance = blur + layout.sigma_b**2
    gaussian = tree.math("POWER", math.exp(-0.5), tree.dot(uv, uv) / variance)
    kernel = gaussian / variance * light.cosine * (zero_order * (1 / (2 * math.pi)))
    mirrored = zero_order_xyz(tree, image, layout, w=w * height_scale) * kernel
    of_light, of_view = (excess_albedo(tree, image, layout, way=way) for way in (light, view))
    bound = albedo_bound(tree, (of_light, of_view), conserving=conserving)
    gain = irradiance * (tree.fresnel(ior, tree.normalize(wi + wr)) / bound)

    def radiance(table_xyz: Value) -> Value:
        rgb = matrix_times(tree, rgb_from_xyz, table_xyz * scattered + mirrored) * gain
        # Spectral colours outside the gamut have a negative component, which no renderer can use.
        return tree.vector_math("MAXIMUM", rgb, (0.0, 0.0, 0.0))

    finer = radiance(finer)
    coarser = finer if coarser is None else radiance(coarser)
    tree.output(finer, coarser, share)
    arrange(group)
    return Response(group)
