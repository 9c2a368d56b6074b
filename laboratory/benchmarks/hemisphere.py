# SPDX-License-Identifier: GPL-3.0-or-later
"""Radiance of a baked surface under light from everywhere: integrals of its table over the hemisphere.

The integrals use no node and no closure: the integrand is precompute/table/radiance.py under a lamp in each direction.
The colour of each direction is clamped to the gamut, as renderers do. The mirror image comes from one direction.

The table is blurred by the coherence kernel, a Gaussian of standard deviation sigma_b in (u, v). A sum over a grid of
step 1.2 sigma_b in (u, v) therefore equals the integral within 2 exp(-2 pi^2 / 1.44) = 2e-6. (u, v) are the tangential
parts of the direction, so the grid covers the middle of the hemisphere. Towards the horizon the solid angle of its
cells is unbounded, and rings of directions take over. Grid and rings fade into each other, because a sum that ends
abruptly loses this accuracy.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from precompute.colour.observer import mirror_xyz
from precompute.colour.spaces import rgb_from_xyz, shown_rgb
from precompute.table.radiance import lamp_radiance, reflected_xyz, zero_order_reflectance
from precompute.table.table import Table

_STEP = 1.2
# The sines of the angles between which the grid fades into the rings.
_FADE = 0.8, 0.95
# Rings are evenly spaced in sin(theta) plus this share of theta: sin(theta) alone hardly changes near the horizon.
_RING_SHARE = 0.35
_RGB = rgb_from_xyz("Rec.709")


@dataclass(frozen=True)
class Surface:
    """A table, the same without its mirror image, and the directions over which integrals are summed.

    directions    (n, 3) unit vectors over the hemisphere around +z
    solid_angles  (n,) steradians"""

    table: Table
    scattering: Table
    directions: np.ndarray
    solid_angles: np.ndarray

    @classmethod
    def of(cls, table: Table) -> "Surface":
        """Split a table and choose its directions."""
        return cls(table, without_mirror(table), *hemisphere(_STEP * table.sigma_b))

    def scattered(self, wr: np.ndarray) -> np.ndarray:
        """What each direction adds to the radiance (n, 3) towards a viewer at wr (3,), in a world of radiance 1."""
        return _answers(self.scattering, self.directions, wr) * self.solid_angles[:, None]

    def mirrored(self, wr: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The direction (1, 3) of the mirror image towards a viewer at wr (3,), and what it adds, (1, 3)."""
        return mirror_of(wr)[None], mirror_rgb(self.table, wr)[None]


def hemisphere(step: float) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (n, 3) over the +z hemisphere, tangential parts at most `step` apart, and solid angles (n,)."""
    count = int(_FADE[1] / step) + 1
    axis = np.arange(-count, count + 1) * step
    u, v = (each.ravel() for each in np.meshgrid(axis, axis))
    share = _inner_share(np.hypot(u, v))
    u, v, share = u[share > 0], v[share > 0], share[share > 0]
    cosine = np.sqrt(1 - u**2 - v**2)
    parts = [(np.stack([u, v, cosine], axis=-1), share * step**2 / cosine)]
    theta = np.linspace(np.arcsin(_FADE[0]), np.pi / 2, 4096)
    along = np.sin(theta) + _RING_SHARE * theta
    rings = int((along[-1] - along[0]) / step) + 1
    each = (along[-1] - along[0]) / rings
    for ring in np.interp(along[0] + (np.arange(rings) + 0.5) * each, along, theta):
        sine, cosine = np.sin(ring), np.cos(ring)
        count = int(2 * np.pi * sine / step) + 1
        phi = (np.arange(count) + 0.5) * 2 * np.pi / count
        wi = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.full(count, cosine)], axis=-1)
        width = each / (cosine + _RING_SHARE)
        parts.append((wi, np.full(count, (1 - _inner_share(sine)) * sine * width * 2 * np.pi / count)))
    return tuple(np.concatenate(each) for each in zip(*parts, strict=True))


def _inner_share(sine: np.ndarray) -> np.ndarray:
    """The weight of the grid, 1 in the middle and 0 towards the horizon, with two continuous derivatives."""
    x = np.clip((np.asarray(sine) - _FADE[0]) / (_FADE[1] - _FADE[0]), 0, 1)
    return 1 - x**3 * (10 - 15 * x + 6 * x**2)


def without_mirror(table: Table) -> Table:
    """The table of the scattered light alone."""
    gains = table.gains and replace(table.gains, mirror=np.zeros_like(table.gains.mirror))
    return replace(table, zero_order=np.zeros_like(table.zero_order), gains=gains)


def mirror_of(wr: np.ndarray) -> np.ndarray:
    """The mirror direction (3,) of a unit vector (3,)."""
    return wr * (-1, -1, 1)


def mirror_rgb(table: Table, wr: np.ndarray) -> np.ndarray:
    """Linear Rec.709 (3,) of the mirror image towards a viewer at wr (3,), in a world of radiance 1."""
    return shown_rgb(zero_order_reflectance(table, mirror_of(wr)[None], wr[None]), _RGB)[0]


def _answers(table: Table, wi: np.ndarray, wr: np.ndarray) -> np.ndarray:
    """Linear Rec.709 (n, 3) towards wr (3,) under unit irradiance from wi (n, 3)."""
    return shown_rgb(reflected_xyz(table, wi, np.broadcast_to(wr, wi.shape)), _RGB)


def directional_albedo(table: Table, theta_r: float) -> np.ndarray:
    """Radiance in linear Rec.709 (3,) in a world of radiance 1, seen along T at theta_r radians from the normal.

    It is the integral of lamp_radiance over the hemisphere, so no direction's colour has a negative component. This
    adds light: red and blue orders of a grating are outside of Rec.709, and a component can exceed 1."""
    scattered = _over_hemisphere(table, theta_r, lambda *ways: lamp_radiance(*ways, irradiance=np.ones(3)))
    return scattered + mirror_rgb(table, _view_at(theta_r))


def directional_albedo_xyz(table: Table, theta_r: float) -> np.ndarray:
    """The same as X, Y and Z (3,) over a mirror's, with every colour as it is: at most 1 in each."""
    wr = _view_at(theta_r)
    mirrored = zero_order_reflectance(table, mirror_of(wr)[None], wr[None])[0]
    return (_over_hemisphere(table, theta_r, reflected_xyz) + mirrored) / mirror_xyz(table.illuminant)


def _view_at(theta_r: float) -> np.ndarray:
    """The unit vector (3,) to a viewer along T at theta_r radians from the normal."""
    return np.array((math.sin(theta_r), 0.0, math.cos(theta_r)))


def _over_hemisphere(
    table: Table, theta_r: float, radiance: Callable[[Table, np.ndarray, np.ndarray], np.ndarray]
) -> np.ndarray:
    """The integral (3,) of the scattered radiance (n, 3) of a table, for wi (n, 3) and wr (n, 3), over wi.

    The polar angle is integrated by Gauss-Legendre quadrature: equal steps would be off by 1 % at the normal, even at
    half a kernel. Around a ring steps are at most a kernel long: equal steps over a Gaussian are then off by 2 exp(-2
    pi^2) = 5e-9."""
    table = without_mirror(table)
    nodes, weights = np.polynomial.legendre.leggauss(math.ceil(math.pi**2 / 4 / table.sigma_b))
    steps = math.ceil(2 * math.pi / table.sigma_b)
    phi = (np.arange(steps) + 0.5) * (2 * math.pi / steps)
    wr = np.broadcast_to(_view_at(theta_r), (steps, 3))
    total = np.zeros(3)
    for theta, weight in zip((nodes + 1) * (math.pi / 4), weights * (math.pi / 4), strict=True):
        sine = math.sin(theta)
        wi = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.full(steps, math.cos(theta))], axis=-1)
        total += radiance(table, wi, wr).sum(axis=0) * (weight * sine)
    return total * (2 * math.pi / steps)
