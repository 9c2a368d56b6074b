# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of spectra in the scene's linear space, by nodes (precompute/colour/gamut.py)."""

import numpy as np

from ..nodes.builder import Tree, Value


def shown_rgb(tree: Tree, rgb_from_xyz: np.ndarray, xyz: Value) -> Value:
    """Linear RGB of a colour in XYZ, by a matrix (3, 3). A colour with negative components is moved towards the grey of
    the same luminance."""
    components = [tree.dot(xyz, (float(x), float(y), float(z))) for x, y, z in rgb_from_xyz]
    y = tree.value(tree.node("ShaderNodeSeparateXYZ", xyz).outputs["Y"])
    return _kept_in(tree, components, tree.vector(*components), y)


def shown_under_lamp(tree: Tree, rgb: Value, luminance: Value) -> Value:
    """The same for linear RGB over that of a lamp; `luminance` is the share of each component in the luminance."""
    components = [tree.value(socket) for socket in tree.node("ShaderNodeSeparateXYZ", rgb).outputs]
    return _kept_in(tree, components, rgb, tree.dot(rgb, luminance))


def _kept_in(tree: Tree, components: list[Value], rgb: Value, y: Value) -> Value:
    red, green, blue = components
    y = tree.maximum(y, 0.0)
    lowest = tree.minimum(tree.minimum(red, green), tree.minimum(blue, 0.0))
    # Blender divides by 0 to 0, so a colour of no luminance becomes black.
    share = tree.math("DIVIDE", y, y - lowest)
    return tree.blend(share, y, rgb)
