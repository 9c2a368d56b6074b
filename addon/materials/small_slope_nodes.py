# SPDX-License-Identifier: GPL-3.0-or-later
"""The small slope reflectance and the ratio form (precompute/optics/small_slope.py, brdf.py) as nodes."""

import math

from ...precompute.optics.small_slope import IOR_MAX
from ..nodes.builder import Tree, Value
from .tangent_space import Direction

# The least product of the squared sines of both angles. In single precision a smaller one has no correct digit.
_SINES_MIN = 1e-6


def dielectric_ior(tree: Tree, ior: Value) -> Value:
    """The index of refraction up to the largest for which the approximation holds."""
    return tree.minimum(ior, IOR_MAX)


def small_slope_over_fresnel(tree: Tree, ior: float, *, light: Direction, view: Direction, one_plus: Value) -> Value:
    """Q over Fresnel's reflectance at the half angle; arguments as in small_slope_reflectance."""
    less_one, cosine2 = ior**2 - 1, one_plus * 0.5
    cosine = tree.sqrt(cosine2)
    total = tree.sqrt(cosine2 + less_one) + cosine
    # Fresnel's reflectance is (less_one / total^2)^2 (1 + tm^2) / 2, with the amplitude tm of TM over that of TE.
    tm = cosine.times_plus(total, -1.0) / (cosine / total).times_plus(less_one, 1.0)
    slopes = small_slope_reflectance(tree, ior, light=light, view=view, one_plus=one_plus)
    return slopes * tree.squared(tree.squared(total)) * (2 / less_one**2) / tm.times_plus(tm, 1.0)


def small_slope_reflectance(
    tree: Tree, ior: Value | float, *, light: Direction, view: Direction, one_plus: Value
) -> Value:
    """Q for unit vectors to the light and to the viewer; `one_plus` is 1 plus their scalar product."""
    permittivity = ior * ior
    less_one = permittivity - 1.0
    cos2_i, cos2_r = tree.squared(light.cosine), tree.squared(view.cosine)
    in_i, in_r = tree.sqrt(cos2_i + less_one), tree.sqrt(cos2_r + less_one)
    along = one_plus - light.cosine.times_plus(view.cosine, 1.0)
    sines = tree.maximum((1.0 - cos2_i) * (1.0 - cos2_r), _SINES_MIN)
    # All amplitudes relative to those of TE to TE. On each side, that of TE is 1 / total, and the ratio of TM to TE has
    # the factor of the vector along the surface, or across.
    total_i, total_r = light.cosine + in_i, view.cosine + in_r
    across_i = total_i / light.cosine.times_plus(permittivity, in_i)
    across_r = total_r / view.cosine.times_plus(permittivity, in_r)
    crossed = tree.squared(across_i * in_i) + tree.squared(across_r * in_r)
    tm_tm = (in_i * in_r).times_plus(along, permittivity * sines) * (across_i * across_r)
    # along^2 / sines is the squared cosine of the azimuth between the directions.
    same = tree.squared(along).times_plus(1.0 - crossed, tree.squared(tm_tm))
    te_te = (less_one * math.sqrt(0.5)) / (total_i * total_r)
    return (same / sines + crossed) * tree.squared(te_te)
