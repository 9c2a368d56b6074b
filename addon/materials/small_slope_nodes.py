# SPDX-License-Identifier: GPL-3.0-or-later
"""The small slope reflectance (precompute/optics/small_slope.py) as nodes."""

from ...precompute.optics.small_slope import IOR_MAX
from ..nodes.builder import Tree, Value
from .tangent_space import Direction

# The least product of the squared sines of both angles. In single precision a smaller one has no correct digit.
_SINES_MIN = 1e-6


def dielectric_ior(tree: Tree, ior: Value) -> Value:
    """The index of refraction up to the largest for which the approximation holds."""
    return tree.minimum(ior, IOR_MAX)


def small_slope_reflectance(tree: Tree, ior: Value, *, light: Direction, view: Direction, one_plus: Value) -> Value:
    """Q for unit vectors to the light and to the viewer; `one_plus` is 1 plus their scalar product."""
    permittivity = tree.squared(ior)
    less_one = permittivity - 1.0
    cos2_i, cos2_r = tree.squared(light.cosine), tree.squared(view.cosine)
    in_i, in_r = tree.sqrt(cos2_i + less_one), tree.sqrt(cos2_r + less_one)
    along = one_plus - light.cosine.times_plus(view.cosine, 1.0)
    sines = tree.maximum((1.0 - cos2_i) * (1.0 - cos2_r), _SINES_MIN)
    aligned = tree.minimum(tree.squared(along) / sines, 1.0)  # the squared cosine of the azimuth between them
    # The amplitudes of TE and of TM on each side. A TM one has the factor of the vector along the surface, or across.
    te_i, te_r = (1.0 / (way.cosine + inside) for way, inside in ((light, in_i), (view, in_r)))
    across_i, across_r = (
        1.0 / way.cosine.times_plus(permittivity, inside) for way, inside in ((light, in_i), (view, in_r))
    )
    tm_i, tm_r = across_i * in_i, across_r * in_r
    te2_i, te2_r, tm2_i, tm2_r = (tree.squared(each) for each in (te_i, te_r, tm_i, tm_r))
    crossed = tm2_i.times_plus(te2_r, te2_i * tm2_r)
    tm_tm = (tm_i * tm_r).times_plus(along, permittivity * sines * (across_i * across_r))
    mixed = aligned.times_plus(te2_i * te2_r - crossed, crossed)
    return (tree.squared(tm_tm) / sines + mixed) * (tree.squared(less_one) * 0.5)
