# SPDX-License-Identifier: GPL-3.0-or-later
"""The mirror image of a lamp in a rough surface.

A smooth surface shows the lamp's own disc. A rough one shows it blurred: its facets tilt by slopes of variance alpha^2
/ 2 along an axis (Beckmann), alpha = roughness^2. A facet that tilts by d turns the reflected direction by 2 d in the
plane of incidence, and by 2 d cos(t) across it. With D the disc's variance along an axis, the image has the variances

    A = D + 2 alpha^2  in the plane of incidence,    B = D + (w alpha)^2 / 2  across,    w = cos(ti) + cos(tr)

Let m be the mirror direction of wr. Its squared distance from wi, in units of length across the plane, is

    t = u^2 + v^2 + (cos(ti) - cos(tr))^2 D / A

Without roughness t is |wi - m|^2, and with a point lamp it is u^2 + v^2. The exact blur of a disc by a Gaussian has no
closed form. A Fermi function takes its place. With s^2 the variance of the blur, and V = D + s^2,

    kernel = sqrt(B / A) z / (z + exp(t / d)) / (pi d q),    d = 2 s sqrt(V),    q = 4 D / d,    z = exp(q) - 1

Its integral over all directions is 1, it tends to the disc of radius sqrt(4 D) for small s and to the Gaussian for
small D. In between its variance is right within 1 %, and its peak within 13 % (where D = s^2)."""

import numpy as np

# The least D, in rad2: a disc with a radius of 2 mrad, half the sun's. A point lamp would be infinitely bright. In
# single precision u, v and the cosines are off by 1e-7, which is a 20,000th of this radius.
LEAST_VARIANCE = 1e-6
# s^2 over D on a smooth skin: the edge is an eighth of a deviation soft, so that exp(q) has single precision.
EDGE = 1 / 64
# The least q. Below, exp(q) - 1 loses its digits in single precision, and the kernel is a Gaussian within 0.5 %.
LEAST_Q = 0.01
# t / d beyond q at which the kernel counts as 0: 8e-10 of the peak.
ENDS = 21.0


def mirror_kernel(
    wi: np.ndarray, wr: np.ndarray, *, variance: np.ndarray | float = 0.0, roughness: float = 0.0
) -> np.ndarray:
    """Radiance (n,) of a lamp's image in a perfect mirror under unit irradiance of a surface that faces the lamp, 1/sr,
    for unit vectors wi (3,) or (n, 3) to the lamp's centre and wr (n, 3) to the viewer.

    `variance`, a number or (n,) in rad2, is the variance of the lamp's disc along one axis."""
    disc, alpha2 = np.maximum(variance, LEAST_VARIANCE), roughness**4
    u, v, w = np.moveaxis(wi + wr, -1, 0)
    slopes = w**2 * alpha2 / 2
    along, across, blur = disc + 2 * alpha2, disc + slopes, disc * EDGE + slopes
    t = u**2 + v**2 + (wi[..., 2] - wr[..., 2]) ** 2 * disc / along
    d = 2 * np.sqrt(blur * (disc + blur))
    q = np.maximum(4 * disc / d, LEAST_Q)
    z, x = np.expm1(q), np.minimum(t / d, q + ENDS)
    kernel = np.sqrt(across / along) * z / (z + np.exp(x)) / (np.pi * d * q)
    return np.where(x < q + ENDS, kernel, 0.0)
