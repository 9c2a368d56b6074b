# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of spectra in the scene's linear space, by nodes (precompute/colour/gamut.py)."""

import numpy as np

from ..nodes.builder import Tree, Value


def shown_rgb(tree: Tree, rgb_from_xyz: np.ndarray, xyz: Value) -> Value:
    """Linear RGB of a colour in XYZ, by a matrix (3, 3). A colour with negative components is moved towards the grey of
    the same luminance."""
    components = [tree.dot(xyz, (float(x), float(y), float(z))) for x, y, z in rgb_from_xyz]
    red, green, blue = components
    y = tree.value(tree.node("ShaderNodeSeparateXYZ", xyz).outputs["Y"])
    y = tree.maximum(y, 0.0)
    lowest = tree.minimum(tree.minimum(red, green), tree.minimum(blue, 0.0))
    # Blender divides by 0 to 0, so a colour of no luminance becomes black.
    share = tree.math("DIVIDE", y, y - lowest)
    return tree.blend(share, y, tree.vector(*components))
