# SPDX-License-Identifier: GPL-3.0-or-later
"""The mirror image of a lamp (precompute/optics/mirror_image.py) as nodes."""

import math
from dataclasses import dataclass

from ....precompute.optics.mirror_image import EDGE, ENDS, LEAST_Q, LEAST_VARIANCE
from ...nodes.builder import Tree, Value, by_group
from ..atlas_nodes import Direction


@dataclass(frozen=True)
class MirrorKernel:
    """The kernel for a lamp and a viewer.

    value    the radiance of the lamp's image in a perfect mirror, under unit irradiance
    is_near  1 where the kernel counts, else 0
    away2    t, the squared distance of the lamp from the mirror direction
    spread   the variance of the image in the plane of incidence; a constant in Cycles for a sun"""

    value: Value
    is_near: Value
    away2: Value
    spread: Value


def mirror_kernel(
    tree: Tree, light: Direction, view: Direction, *, uv2: Value, variance: Value, roughness: Value
) -> MirrorKernel:
    """Add the nodes for directions above the surface, and u^2 + v^2 of their sum."""
    given = {
        "cos_i": light.cosine, "cos_r": view.cosine, "uv2": uv2, "variance": variance, "roughness": roughness,
    }  # fmt: skip
    gives = dict.fromkeys(("value", "is_near", "away2", "spread"), "Float")
    return MirrorKernel(*by_group(tree, "Mirror Image", _kernel, given=given, gives=gives))


def _kernel(
    tree: Tree, *, cos_i: Value, cos_r: Value, uv2: Value, variance: Value, roughness: Value
) -> tuple[Value, Value, Value, Value]:
    disc, alpha2 = tree.maximum(variance, LEAST_VARIANCE), tree.squared(roughness * roughness)
    slopes = tree.squared(cos_i + cos_r) * (alpha2 * 0.5)
    along, across, blur = alpha2.times_plus(2.0, disc), disc + slopes, disc.times_plus(EDGE, slopes)
    away2 = tree.squared(cos_i - cos_r).times_plus(disc / along, uv2)
    d = tree.sqrt(blur * (disc + blur)) * 2.0
    q = tree.maximum(disc * 4.0 / d, LEAST_Q)
    ends = q + ENDS
    x = tree.minimum(away2 / d, ends)
    z = tree.math("EXPONENT", q) - 1.0
    height = tree.sqrt(across / along) / (d * q) * (1 / math.pi)
    value = z / (z + tree.math("EXPONENT", x)) * height
    return value, tree.math("LESS_THAN", x, ends), away2, along
