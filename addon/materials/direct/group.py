# SPDX-License-Identifier: GPL-3.0-or-later
"""The Direct node group: what a baked surface answers to one lamp, without noise.

| socket         | symbol | unit    | default | meaning |
|----------------|--------|---------|---------|---------|
| Normal         | N      |         |         | shading normal, unit |
| Tangent        | T      |         |         | direction of the scan's columns, unit, across N |
| To Light       | wi     |         |         | unit |
| Irradiance     | E      | W/m2    |         | on a surface that faces the lamp |
| Variance       |        | rad2    | 0       | of the lamp's disc in the sky, along one axis |
| Roughness      | r      |         | 0       | of the skin over the relief: alpha = r^2, as Blender's own |
| IOR            | n      |         | 1.56    | of the skin: sets how much is reflected at all |
| Period Scale   | p      |         | 1       | stretches the relief along the surface |
| Height Scale   | c      |         | 1       | scales the relief's heights; at most 1, as the table ends at w = 2 |
| Energy Conserving | e   |         | 1       | 0 is Stam's formula, which towards grazing reflects more than arrives |
| Finer, Coarser (out) | Lo | W/m2/sr |       | radiance, linear RGB, by the two levels next to the blur |
| Coarser Share (out) |  |         |         | share of Coarser in their mix |

    Lo = E R / M [ (1 + wi.wr)^2 / cos(tr) * p^2 c^2 sum_k T_k(t(c w)) B_k(p u, p v) + cos(ti) Z(c w) kernel(u, v) ]

    M = 1 + e max(0, X(wi) / cos(ti), X(wr) / cos(tr))

which is f * E * cos(ti) with Stam's obliquity (docs/theory.md). The w^2 in the obliquity cancels the table's. M is the
albedo bound: it keeps the surface from reflecting more than arrives. X is the excess albedo of the relief as baked
(precompute/table/albedo_bound.py). B_k are read from the blurred levels (precompute/table/atlas.py) next to the
variance

    sigma^2 = sigma_b^2 + max(0, Variance (1 + cos(ti)^2) / 2 - sigma_b^2) + (w r^2)^2 / 2

The second term is the lamp's disc. The bake's own kernel already stands for a disc of its size, so only the rest of the
disc's variance is added. Seen from the surface, a disc keeps its width across the plane of incidence and has cos(ti) of
it within the plane; the mean of both variances is taken. The third term is the skin's roughness: the slopes of a
Beckmann lobe have a variance of alpha^2 / 2.
"""

import math

import bpy
import numpy as np

from ....precompute.table.albedo_bound import bound_texel
from ....precompute.table.atlas import STRIP_ROWS, Layout
from ....precompute.table.tiling import LEVEL_PADDING, TILE_PADDING
from ...nodes.arrange import arrange
from ...nodes.builder import Tree, Value
from ...nodes.interface import add_interface
from ..response import QUESTION, TWO_RADIANCES, Response

GROUP_PREFIX = "Diffraction Direct"


def build_direct_group(name: str, image: bpy.types.Image, layout: Layout, *, rgb_from_xyz: np.ndarray) -> Response:
    """The response of one bake. `image` holds its atlas; rgb_from_xyz (3, 3) leads to the scene's linear space."""
    group = bpy.data.node_groups.new(f"{GROUP_PREFIX} {name}", "ShaderNodeTree")
    add_interface(group, QUESTION, TWO_RADIANCES)
    tree = Tree(group)
    asked = tree.inputs()
    inputs = (asked[socket.name] for socket in QUESTION)
    n, t, wi, irradiance, variance, roughness, ior, period_scale, height_scale, conserving = inputs

    b = tree.cross(n, t)
    wr = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Incoming"])
    light, view = (_Direction(tree, way, (t, b, n)) for way in (wi, wr))
    half = light.vector + view.vector
    w = light.cosine + view.cosine
    uv = half * (1.0, 1.0, 0.0)
    half2 = tree.dot(half, half)  # 2 (1 + wi.wr)

    slope = w * (roughness * roughness)
    disc = variance * tree.squared(light.cosine).times_plus(0.5, 0.5)
    blur = tree.maximum(disc - layout.sigma_b**2, 0.0) + slope * slope * 0.5
    table = _Table(tree, image, layout, uv=uv * period_scale, w=w * height_scale)
    # The kernel belongs to the relief and is stretched with it. The blur by lamp and roughness is not.
    finer, coarser, share = table.around(blur * (period_scale * period_scale))

    obliquity = half2 * half2 / tree.maximum(view.cosine, 1e-6)
    scattered = obliquity * (tree.squared(period_scale * height_scale) * (layout.scale / 4))
    mirrored = _zero_order(table, radius2=tree.dot(uv, uv), w=w * height_scale, blur=blur, cos_i=light.cosine)
    excess = tree.maximum(tree.maximum(*(_excess_albedo(table, way) for way in (light, view))), 0.0)
    bound = excess.times_plus(conserving, 1.0)
    gain = irradiance * (tree.fresnel(ior, tree.normalize(wi + wr)) / bound)

    def radiance(table_xyz: Value) -> Value:
        rgb = _matrix(tree, rgb_from_xyz, table_xyz * scattered + mirrored) * gain
        # Spectral colours outside the gamut have a negative component, which no renderer can use.
        return tree.vector_math("MAXIMUM", rgb, (0.0, 0.0, 0.0))

    finer = radiance(finer)
    coarser = finer if coarser is None else radiance(coarser)
    tree.output(finer, coarser, share)
    arrange(group)
    return Response(group)


class _Direction:
    """A unit vector in the surface's frame: its components along T, B and N, one by one and as a vector."""

    def __init__(self, tree: Tree, direction: Value, frame: tuple[Value, Value, Value]):
        self.x, self.y, self.cosine = (tree.dot(direction, axis) for axis in frame)
        self.vector = tree.vector(self.x, self.y, self.cosine)


class _Table:
    """sum_k T_k(t) B_k(u, v) / scale, XYZ over w^2, with one look-up for each term; t goes from -1 to 1 over the range
    of w.

    Outside the table's region its rim is read, because the polynomials are not bounded there and other tiles lie
    beside it. Beyond |(u, v)| = 2, which only a stretched relief reaches, the sum is 0."""

    def __init__(self, tree: Tree, image: bpy.types.Image, layout: Layout, *, uv: Value, w: Value):
        self.tree, self.image, self.layout = tree, image, layout
        (u_low, u_high), (v_low, v_high) = layout.region
        inner = tree.clamp(uv, (u_low, v_low, 0.0), (u_high, v_high, 0.0))
        x, y, _ = _over(1 / layout.texel, (layout.width, layout.height))
        self.place = inner.times_plus((x, y, 0.0), (-u_low * x, -v_low * y, 0.0))
        half_range = (layout.w_max - layout.w_min) / 2
        t = w.times_plus(1 / half_range, -(layout.w_min + layout.w_max) / 2 / half_range)
        self.t = tree.maximum(tree.minimum(t, 1.0), -1.0)
        self.inside = tree.math("LESS_THAN", tree.dot(uv, uv), 4.0)

    def around(self, blur: Value) -> tuple[Value, Value | None, Value | float]:
        """The table at the two levels next to a variance, and the share of the coarser level in their mix.

        `blur` is the variance beyond the bake's own. The share makes the mix have the right variance. It may exceed 1
        and is clamped by the Mix Shader, so that a blur beyond the last level is the last level's. A table of one level
        has no coarser one: None, with a share of 0."""
        if self.layout.levels == 1:
            return self._read(), None, 0.0
        tree, last = self.tree, self.layout.levels - 1
        ratio = blur.times_plus(1 / self.layout.sigma_b**2, 1.0)  # sigma^2 over sigma^2 of level 0
        level = tree.minimum(tree.math("FLOOR", tree.math("LOGARITHM", ratio, 4.0)), last - 1.0)
        shrink = tree.math("POWER", 0.5, level)
        share = (ratio * tree.squared(shrink)).times_plus(1 / 3, -1 / 3)
        # Level 0 begins at the left; the others are stacked to the right of it (precompute/table/tiling.py).
        finer = self._read(self._beside(level, shrink) * tree.minimum(level, 1.0), shrink)
        level, shrink = level + 1.0, shrink * 0.5
        return finer, self._read(self._beside(level, shrink), shrink), share

    def _beside(self, level: Value, shrink: Value) -> Value:
        """The offset from the first level's block to another level's, as a fraction of the image."""
        layout, (rows, columns) = self.layout, self.layout.tile_stride(0)
        size = layout.width, layout.height
        each, first, shrunk = (
            _over((x, layout.rows * y), size)
            for x, y in (
                (0.0, LEVEL_PADDING),
                (layout.columns * columns, rows - 2 * LEVEL_PADDING),
                (0.0, -2.0 * (rows - LEVEL_PADDING)),
            )
        )
        return level.times_plus(each, shrink.times_plus(shrunk, first))

    def _read(self, block: Value | None = None, shrink: Value | None = None) -> Value:
        """The sum at a level. `block` is the offset of the level's block, `shrink` the ratio of its number of texels
        along an axis to level 0's. Without them the nodes read level 0 only."""
        tree, layout = self.tree, self.layout
        size = layout.width, layout.height
        rows, columns = layout.tile_stride(0)
        middle = _over((TILE_PADDING + 0.5, layout.strip_rows + TILE_PADDING + 0.5), size)
        if block is None:
            at, stride = self.place + middle, None
        else:
            at = self.place.times_plus(shrink, block + middle)
            inner, padding = (_over(n, size) for n in ((columns - LEVEL_PADDING, rows - LEVEL_PADDING), LEVEL_PADDING))
            stride = shrink.times_plus(inner, padding)
        terms = []
        for k in range(layout.terms):
            row, column = divmod(k, layout.columns)
            if stride is None:
                place = at + _over((column * columns, row * rows), size)
            else:
                place = stride.times_plus((float(column), float(row), 0.0), at) if k else at
            terms.append(tree.image(self.image, place, label=f"B{k}"))
        return _chebyshev_sum(terms, self.t) * self.inside


def _chebyshev_sum(terms: list[Value], t: Value) -> Value:
    """sum_k T_k(t) B_k by Clenshaw's recurrence: b_k = B_k + 2 t b_(k+1) - b_(k+2), the sum B_0 + t b_1 - b_2."""
    twice = t * 2.0
    after, last = None, terms[-1]
    for term in terms[-2:0:-1]:
        after, last = last, last.times_plus(twice, term if after is None else term - after)
    return last.times_plus(t, terms[0] if after is None else terms[0] - after)


def _over(value: float | tuple[float, float], size: tuple[int, int]) -> tuple[float, float, float]:
    """A number of texels along x and y as a fraction of the image."""
    x, y = value if isinstance(value, tuple) else (value, value)
    return x / size[0], y / size[1], 0.0


def _zero_order(table: _Table, *, radius2: Value, w: Value, blur: Value, cos_i: Value) -> Value:
    """The zero order, Z(w) kernel(u, v) cos(ti), in XYZ; radius2 is u^2 + v^2."""
    tree, layout = table.tree, table.layout
    step = (layout.zero_order_samples - 1) / 2
    x = w.times_plus(step / layout.width, 0.5 / layout.width)
    z = tree.image(table.image, tree.vector(x, STRIP_ROWS / 2 / layout.height, 0.0), label="Z")
    variance = blur + layout.sigma_b**2
    gaussian = tree.math("POWER", math.exp(-0.5), radius2 / variance)
    return z * (gaussian / variance * cos_i * (1 / (2 * math.pi)))


def _excess_albedo(table: _Table, way: _Direction) -> Value:
    """X / cos(t) of a direction. The image holds X on a disc, laid flat as precompute/table/albedo_bound.py tells."""
    tree, layout = table.tree, table.layout
    size = layout.width, layout.height
    cosine = tree.maximum(way.cosine, 1e-6)
    sum_ = tree.sqrt(cosine) + 1.0
    along = tree.math("INVERSE_SQRT", cosine.times_plus(sum_, sum_))
    middle = layout.bound_texels / 2
    step = _over(1 / bound_texel(layout.bound_texels), size)
    place = (way.vector * along).times_plus(step, _over((middle, STRIP_ROWS + middle), size))
    # All channels are alike, so that Blender's conversion of a colour to a number leaves it as it is.
    return tree.math("DIVIDE", tree.image(table.image, place, label="X"), cosine)


def _matrix(tree: Tree, matrix: np.ndarray, vector: Value) -> Value:
    """A matrix (3, 3) times a vector."""
    rows = [tree.dot(vector, tuple(float(m) for m in row)) for row in matrix]
    return tree.vector(*rows)
