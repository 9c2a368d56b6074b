# SPDX-License-Identifier: GPL-3.0-or-later
"""Brings the colours of spectra into the linear space of a renderer.

A spectrum's colour is purer than the primaries of an RGB space, so some components are negative, which renderers cannot
use. To set them to 0 adds light: a CD would reflect 6 % too much in Rec.709. A colour is instead moved towards the grey
of the same luminance, until no component is negative. So all light is kept, whatever the number of lamps.

addon/materials/gamut_nodes.py does the same with nodes, addon/materials/osl/gamut.osl in a shader."""

import numpy as np


def shown_rgb(xyz: np.ndarray, rgb_from_xyz: np.ndarray) -> np.ndarray:
    """Linear RGB (..., 3), without negative components, of colours in XYZ (..., 3), for a matrix (3, 3) of
    working_space.rgb_from_xyz.

    A colour with negative components becomes Y + Y / (Y - m) (rgb - Y), where m is the least of them. Its luminance
    stays Y. A colour without luminance becomes black."""
    rgb = xyz @ rgb_from_xyz.T
    y = np.maximum(xyz[..., 1:2], 0)
    lowest = np.minimum(rgb.min(axis=-1, keepdims=True), 0)
    share = np.divide(y, y - lowest, out=np.zeros_like(y), where=y > 0)
    # Rounding leaves a component of -1e-17 where the least one is 0.
    return np.maximum(y + share * (rgb - y), 0)
