# SPDX-License-Identifier: GPL-3.0-or-later
"""The World node group: glossy closures for light from unknown directions on a baked surface.

| socket            | symbol | default | meaning |
|-------------------|--------|---------|---------|
| Normal, Tangent   | N, T   |         | as in the Direct group (direct/direct_group.py), as are the settings |
| Mirror (out)      |        |         | colour of a closure around N: the zero order |
| Mirror Roughness (out) |   |         | of that closure |
| Lobe (out)        |        |         | colour of a closure around Lobe Normal: one order of the scattered light |
| Lobe Normal (out) |        |         | normalize(wi + wr) |
| Lobe Roughness (out) |     |         | of that closure |
| Lobe Direction (out) | wi  |         | the direction that the order comes from, unit |

A glossy closure reflects its colour at any roughness and any tilt of its normal. So the mean over many draws is the
scattered light, if each draw has the colour

    C = D c^2 G W(q; c w / lambda) / lambda^2 rgb(u, v, w) / (X + Y + Z)(u, v, w)

G is 4 cos(ti) cos(tr) Q for a dielectric, and R (1 + wi.wr)^2 / (cos(ti) cos(tr)) / M for a table that holds its
matter's reflectance. R is this reflectance at the drawn wavelength and the half angle. The table's colour below has no
brightness, so the table's own R does not count.
The frequency q is drawn from the sample set (precompute/table/sample_set.py), which also gives its weight W. The
wavelength lambda is drawn in proportion to the observer's X + Y + Z, whose integral is D
(precompute/colour/drawn_wavelengths.py). They determine the direction wi: its tangential part is lambda q / p minus the
view's. The colour of a single wavelength would be out of gamut and different in each draw. So a draw shows the table's
colour in its direction, the mean over all wavelengths from there. The other symbols are defined in
direct/direct_group.py.

Under a plate, C has the directions inside, and is multiplied by what the front face lets through on both ways, T(ti)
T(tr). An order that the front face reflects totally is black. The closure is around the directions above the plate.

The closure combines the width of the coherence kernel, with the standard deviation sigma_b in (u, v), and the skin's
roughness r: alpha^2 = 2 sigma_b^2 / w^2 + r^4. This is exact for a Beckmann lobe. The bins of the spectrum may already
include a part of the kernel (blur_q), which is subtracted here. If Sharp is 1, the kernel moves the direction at random
instead, and the closure is a perfect mirror. The place where the colour is read moves in both cases, so that the
colours of many draws add up correctly. A wide closure cannot tell in which of its directions the light is, so with it
the kernel blurs the colours twice."""

import math
from collections.abc import Callable

import bpy
import numpy as np

from ....precompute.colour.drawn_wavelengths import drawn_weight
from ....precompute.table.atlas import Layout
from ...nodes.arrange import arrange
from ...nodes.builder import Tree, Value
from ...nodes.interface import add_interface
from ..atlas_nodes import AtlasTable, albedo_bound, excess_albedo, zero_order_xyz
from ..gamut_nodes import shown_rgb
from ..plate_nodes import Plate
from ..response import WORLD_ANSWER, WORLD_QUESTION
from ..small_slope_nodes import dielectric_ior, small_slope_reflectance
from ..tangent_space import Direction
from .random_draw import SampleSetNodes

GROUP_PREFIX = "Diffraction World"
# The least cosine of a drawn direction. At or below the horizon, the weight of a lobe is not finite.
_COSINE_MIN = 1e-4
# The least X + Y + Z of the table relative to its scale, to avoid a division by 0.
_SUM_MIN = 1e-9


def build_world_group(
    name: str, image: bpy.types.Image, layout: Layout, *, draws: SampleSetNodes, rgb_from_xyz: np.ndarray
) -> bpy.types.NodeTree:
    """The World group of one bake, from its atlas and its sample set. rgb_from_xyz (3, 3) gives the scene's RGB."""
    group = bpy.data.node_groups.new(f"{GROUP_PREFIX} {name}", "ShaderNodeTree")
    add_interface(group, WORLD_QUESTION, WORLD_ANSWER)
    tree = Tree(group)
    asked = tree.inputs()
    n, t, sharp, roughness, ior, period_scale, height_scale = (asked[each.name] for each in WORLD_QUESTION)
    b = tree.cross(n, t)
    geometry = tree.node("ShaderNodeNewGeometry")
    wr = tree.value(geometry.outputs["Incoming"])
    plate = Plate(layout.plate_ior)
    to_view = Direction.seen_in(tree, wr, (t, b, n))
    view = plate.inside(tree, to_view)
    cos_r = tree.maximum(view.cosine, _COSINE_MIN)
    skin = tree.squared(tree.squared(roughness))

    def width(variance: Value | float, w: Value) -> Value:
        """The roughness of a closure with a variance in (u, v), including the skin's."""
        alpha2 = tree.math("DIVIDE", variance * 2.0 if isinstance(variance, Value) else 2 * variance, w * w) + skin
        return tree.math("POWER", tree.minimum(alpha2, 1.0), 0.25)

    seen = tree.math("GREATER_THAN", to_view.cosine, 0.0)
    passed = plate.passed(tree, to_view, view) if plate.present else None
    if not layout.holds_reflectance:
        ior = dielectric_ior(tree, ior)
    excess_of_view = excess_albedo(tree, image, layout, way=view) if layout.holds_reflectance else None

    def reflectance(light: Direction, normal: Value) -> Value:
        """Fresnel's reflectance of the mirror with a normal; 1 over the albedo bound, if the table holds it."""
        if excess_of_view is None:
            return tree.fresnel(ior, normal)
        return 1.0 / albedo_bound(tree, excess_albedo(tree, image, layout, way=light), excess_of_view)

    def with_plate(light: Value, to_light: Direction, inside: Direction) -> Value:
        """Light times what the plate's front face lets through, on the way in and out."""
        return light if passed is None else light * (plate.passed(tree, to_light, inside) * passed)

    def to_space(direction: Direction) -> Value:
        return t * direction.x + b * direction.y + n * direction.cosine

    def mirrored_xyz(to_light: Direction) -> Value:
        light = plate.inside(tree, to_light)
        half = tree.normalize(to_space(to_light) + wr)
        zero_order = zero_order_xyz(tree, image, layout, w=(light.cosine + cos_r) * height_scale)
        return with_plate(zero_order * reflectance(light, half), to_light, light)

    # The kernel above a plate, around the mirror image there.
    sigma, cos_above = layout.sigma_b * plate.ior, tree.maximum(to_view.cosine, _COSINE_MIN) if plate.present else cos_r
    mirrored = _mean_over_mirror_image(tree, mirrored_xyz, view=to_view.vector, cosine=cos_above, sigma=sigma)
    mirrored = shown_rgb(tree, rgb_from_xyz, mirrored) * seen
    mirror_roughness = width(sigma**2, cos_above * 2.0)

    place = tree.value(geometry.outputs["Position"])
    draw = draws.add_to(tree, place)
    ratio = draw.wavelength  # relative to the sample set's wavelength
    kernel = tree.maximum((ratio * ratio).times_plus(-(draws.layout.blur**2), layout.sigma_b**2), 0.0)
    moved = draw.normal * tree.sqrt(kernel)
    uv = draw.uv * ratio + moved * sharp
    # A stretched relief has lower frequencies.
    tangential = tree.arithmetic("DIVIDE", uv, tree.vector(period_scale, period_scale, 1.0))
    tangential = tangential - view.vector * (1.0, 1.0, 0.0)
    cosine2 = 1.0 - tree.dot(tangential, tangential)
    cos_i = tree.sqrt(tree.maximum(cosine2, _COSINE_MIN**2))
    light = Direction.of(tree, tangential + tree.vector(0.0, 0.0, cos_i))
    half = light.vector + view.vector
    w = cos_i + cos_r
    weight = draw.weight(w * height_scale / ratio)
    half2 = tree.dot(half, half) * 0.5  # 1 + wi.wr
    above = plate.above(tree, light)
    to_light = to_space(above)
    lobe_normal = tree.normalize(to_light + wr)
    read = Direction.of(tree, draw.uv * ratio + moved)
    table = AtlasTable(tree, image, layout, uv=(read.x, read.y), w=w * height_scale)
    xyz = table.sharp() * table.inside
    total = tree.maximum(tree.dot(xyz, (1.0, 1.0, 1.0)), _SUM_MIN)
    # No light has a larger component than the most saturated colour. Rounding errors of the table in the dark may.
    red, green, blue = (float(row.max()) for row in rgb_from_xyz)
    colour = shown_rgb(tree, rgb_from_xyz, xyz) * tree.math("DIVIDE", 1.0, total)
    colour = tree.vector_math("MINIMUM", colour, (red, green, blue)) * drawn_weight(layout.illuminant)
    if plate.present:
        cosine2 = plate.cosine2_above(tree, light)
    real = tree.math("GREATER_THAN", cosine2, _COSINE_MIN**2) * seen
    if layout.holds_reflectance:
        # |wi + wr| / 2 is the cosine of the half angle.
        matter = draw.reflectance(tree.sqrt(half2 * 0.5))
        factor = tree.squared(half2) / (cos_i * cos_r) * reflectance(light, lobe_normal) * matter
    else:
        slopes = small_slope_reflectance(tree, ior, light=light, view=view, one_plus=half2)
        factor = cos_i * cos_r * slopes * 4.0
    gain = with_plate(tree.squared(height_scale / ratio) * weight * factor * real, above, light)
    lobe = colour * tree.maximum(gain, 0.0)
    if plate.present:
        kernel, w = kernel * plate.ior**2, above.cosine + to_view.cosine
    lobe_roughness = width(kernel, w) * (1.0 - sharp)
    tree.output(mirrored, mirror_roughness, lobe, lobe_normal, lobe_roughness, to_light)
    arrange(group)
    return group


def _mean_over_mirror_image(
    tree: Tree, factor: Callable[[Direction], Value], *, view: Value, cosine: Value, sigma: float
) -> Value:
    """The colour of a mirror closure that shows the mean of `factor` over the mirror image's kernel, a Gaussian in (u,
    v) with standard deviation sigma. `factor` depends on the direction to the light. Near the horizon Fresnel's
    reflectance, the zero order and the albedo bound vary strongly within the kernel.

    Only directions with (u, v) within the unit disc exist. In the plane of incidence, the kernel's centre is 1 - sin(t)
    from the rim. So the remaining distribution is a normal one, truncated at x = (1 - sin(t)) / sigma. The mean is
    taken over two points that have the mean and the variance of the truncated distribution. Its share Phi(x) is
    approximated to 3e-4 (Page 1977).

    Near the horizon the closure itself loses light, where its facets shadow each other or reflect downwards. The
    closure is as wide as the kernel, alpha = sqrt(2) sigma / w, so its loss depends on x alone (Smith's shadowing of a
    Beckmann distribution, Walter et al. 2007, equation 27, integrated over the facets). The result is divided by what
    remains. The fit of the loss is within 0.004 of the integral for every sigma up to 0.015."""
    sine = tree.sqrt(tree.maximum(1.0 - cosine * cosine, 0.0))
    x = tree.minimum(cosine * cosine / (sine + 1.0) * (1 / sigma), 8.0)
    cube = x * x * x
    share = tree.math("TANH", (cube * 0.044715 + x) * math.sqrt(2 / math.pi)).times_plus(0.5, 0.5)
    density = tree.math("EXPONENT", x * x * -0.5) * (1 / math.sqrt(2 * math.pi))
    cut = density / share
    middle = sine - cut * sigma
    spread = tree.sqrt(tree.maximum(1.0 - cut * (cut + x), 0.0)) * sigma
    away = tree.normalize(view * (-1.0, -1.0, 0.0))  # along the surface, away from the viewer

    def factor_at(u: Value) -> Value:
        up = tree.sqrt(tree.maximum(1.0 - u * u, _COSINE_MIN**2))
        return factor(Direction.of(tree, away * u + tree.vector(0.0, 0.0, up)))

    nearer, further = middle - spread, middle + spread
    total = factor_at(nearer) + factor_at(further)
    loss = x * tree.math("EXPONENT", x * x.times_plus(-1.39, -2.133)) * 0.612
    return total * share * 0.5 / (1.0 - loss)
