# SPDX-License-Identifier: GPL-3.0-or-later
"""What a surface answers to light: the sockets that every response shares."""

from ...precompute.optics.fresnel import KERATIN_IOR
from ..nodes.interface import Socket

IOR = Socket("IOR", "Float", "Index of refraction: 1.56 is keratin, 2.5 and above metal-like", KERATIN_IOR, 1.0, 10.0)


ROUGHNESS = Socket("Roughness", "Float", "Of the skin over the relief: blurs the colours", 0.0, 0.0, 1.0, "FACTOR")


PERIOD_SCALE = Socket(
    "Period Scale", "Float", "Stretches the relief along the surface; 2 halves its colours' angles", 1.0, 0.1, 10.0
)


HEIGHT_SCALE = Socket(
    "Height Scale", "Float", "Of the relief's heights: 0 is a mirror, 1 as baked, the most", 1.0, 0.0, 1.0, "FACTOR"
)


CONSERVING = Socket(
    "Energy Conserving", "Float", "Keeps reflected light under the received; 0 is Stam's form", 1.0, 0.0, 1.0, "FACTOR"
)


INPUTS = (
    Socket("Normal", "Vector", "Shading normal"),
    Socket("Tangent", "Vector", "Direction of the scan's columns on the surface"),
    Socket("To Light", "Vector", "Unit vector to the lamp"),
    Socket("Irradiance", "Vector", "On a surface that faces the lamp, W/m2"),
    Socket("Variance", "Float", "Of the lamp's disc in the sky, rad2", 0.0, 0.0, 10.0),
    ROUGHNESS,
    IOR,
    PERIOD_SCALE,
    HEIGHT_SCALE,
    CONSERVING,
)
