# SPDX-License-Identifier: GPL-3.0-or-later
"""The mirror image (the zero order) of a baked surface, as the colour of one glossy closure.

The closure shows the mean of the zero order over the mirror image's kernel, a Gaussian in (u, v) with standard
deviation sigma. Near the horizon Fresnel's reflectance, the zero order and the albedo bound vary strongly within it.

Only directions with (u, v) within the unit disc exist. In the plane of incidence, the kernel's centre is 1 - sin(t)
from the rim. So the remaining distribution is a normal one, truncated at x = (1 - sin(t)) / sigma. The mean is taken
over two points of the plane of incidence that have the mean and the variance of the truncated distribution. Both read
the zero order at one w, the mean of theirs weighted by reflectance: on the samples of reptiles and discs this changes
the colour by at most half a percent, and only near the horizon.

Near the horizon the closure itself loses light, where its facets shadow each other or reflect downwards. The closure is
as wide as the kernel, alpha = sqrt(2) sigma / w, so its loss depends on x alone (Smith's shadowing of a Beckmann
distribution, Walter et al. 2007, equation 27, integrated over the facets). The result is divided by what remains.

With Phi and phi of the normal distribution, and y = phi(x) / Phi(x), two fits replace these functions:

    y                                    exp of a cubic in x, within 1.3e-4
    1 - Phi(x) / (1 - loss)              y times a polynomial in y; within 0.005 for every sigma up to 0.015"""

import numpy as np

from ...nodes.builder import Tree, Value
from ..atlas_nodes import mirror_gain, zero_order_at
from ..gamut_nodes import shown_rgb
from ..lamp_table_nodes import LampColours
from ..tangent_space import Direction
from .seen_surface import COSINE_MIN, SeenSurface

# Coefficients in ascending powers: of x in the logarithm of y, and of y in the share that is lost.
_CUT = (-0.2258087, -0.79868817, -0.17570105, -0.04604199)
_LOST = (0.0, 0.3154179, 1.8708083, -6.56632187, 9.08209394, -3.98180142)


def mirror_image(
    surface: SeenSurface, rgb_from_xyz: np.ndarray, sigma: float, *, of_world: LampColours | None = None
) -> list[Value]:
    """The colour of the closure of the mirror image, for a kernel with standard deviation sigma above a plate; then
    the colour `of_world`, if it is given."""
    tree, cosine = surface.tree, surface.cosine_above
    squared = tree.squared(cosine)
    sine = tree.sqrt(tree.maximum(1.0 - squared, 0.0))
    x = tree.math("DIVIDE", squared * (1 / sigma), sine + 1.0)
    cut = tree.math("EXPONENT", _polynomial(x, _CUT))
    middle = cut.times_plus(-sigma, sine)
    spread = tree.sqrt(tree.maximum(1.0 - cut * (cut + x), 0.0)) * sigma
    (w, answer), (other_w, other) = (_point(surface, u, sine) for u in (middle - spread, middle + spread))
    total = answer + other
    w = tree.math("DIVIDE", other.times_plus(other_w, answer * w), total)
    triples = surface.layout.triples if of_world is not None else 1
    w = w * surface.height_scale
    image, layout = surface.image, surface.layout
    channels = [zero_order_at(tree, image, layout, w=w, triple=triple) for triple in range(triples)]
    if surface.plate.present:
        more = surface.over_bound(2.0, surface.inside)
        gains = (mirror_gain(tree, image, layout, way=surface.above, triple=triple) for triple in range(triples))
        channels = [colour * total + gain * more for colour, gain in zip(channels, gains, strict=True)]
    colours = [shown_rgb(tree, rgb_from_xyz, channels[0])]
    if of_world is not None:
        colours.append(of_world.shown(channels))
    half_share = _polynomial(cut, [0.5 * (power == 0) - 0.5 * each for power, each in enumerate(_LOST)])
    share = half_share * surface.is_seen
    if not surface.plate.present:
        share = total * share
    return [tree.blend(share, 0.0, colour) for colour in colours]


def mirror_roughness(surface: SeenSurface, sigma: float, skin: Value) -> Value:
    """The roughness of this closure, including the skin's."""
    variance = surface.tree.math("DIVIDE", sigma**2 / 2, surface.tree.squared(surface.cosine_above))
    return roughness_of(surface.tree, variance + skin)


def roughness_of(tree: Tree, alpha2: Value) -> Value:
    """The roughness of a closure with the squared width alpha2."""
    return tree.sqrt(tree.sqrt(tree.minimum(alpha2, 1.0)))


def _point(surface: SeenSurface, u: Value, sine: Value) -> tuple[Value, Value]:
    """w, and the reflectance without the zero order, for light in the plane of incidence whose tangential component is
    u, away from the viewer."""
    tree = surface.tree
    cosine = tree.sqrt(tree.maximum(1.0 - u * u, COSINE_MIN**2))
    if not surface.layout.holds_reflectance:
        w = cosine + surface.cosine
        return w, _fresnel(tree, surface.ior, w.times_plus(w, tree.squared(u - sine)))
    # Blender divides by 0 to 0, so light along the normal stays there.
    along = tree.math("DIVIDE", u, sine * -1.0)
    x, y = surface.above.x * along, surface.above.y * along
    above = Direction(x, y, cosine)
    inside = surface.plate.inside(tree, above)
    return inside.cosine + surface.cosine, surface.through_plate(surface.over_bound(1.0, inside), above, inside)


def _fresnel(tree: Tree, ior: Value, sum2: Value) -> Value:
    """Unpolarised reflectance of a dielectric's mirror, given the squared length of wi + wr: 2 cos of its angle.

    Blender's Fresnel node would need the mirror's normal, whose vectors take more time."""
    cosine = tree.sqrt(sum2)
    root = tree.sqrt((tree.squared(ior) - 1.0).times_plus(4.0, sum2))
    more, less = root + cosine, root - cosine
    across = tree.math("DIVIDE", less, more)
    within = tree.math("DIVIDE", cosine.times_plus(more, -4.0), cosine.times_plus(less, 4.0))
    return tree.squared(across) * tree.squared(within).times_plus(0.5, 0.5)


def _polynomial(x: Value, coefficients: tuple[float, ...] | list[float]) -> Value:
    """A polynomial, from its coefficients in ascending powers."""
    *lower, second, highest = coefficients
    value = x.times_plus(highest, second)
    for each in reversed(lower):
        value = value.times_plus(x, each)
    return value
