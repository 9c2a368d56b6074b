# SPDX-License-Identifier: GPL-3.0-or-later
"""Radiance of a baked surface under light from everywhere: integrals of its table over the hemisphere.

The integrals use no node and no closure: the integrand is precompute/table/radiance.py under a lamp in each direction.
The colour of each direction is clamped to the gamut, as renderers do. Scattered light and mirror image are integrated
separately because the mirror image is a narrow peak.

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

from precompute.colour.gamut import shown_rgb
from precompute.colour.observer import mirror_xyz
from precompute.colour.working_space import rgb_from_xyz
from precompute.table.radiance import lamp_radiance, reflected_xyz
from precompute.table.table import Table

_STEP = 1.2
# The sines of the angles between which the grid fades into the rings.
_FADE = 0.8, 0.95
# Rings are evenly spaced in sin(theta) plus this share of theta: sin(theta) alone hardly changes near the horizon.
_RING_SHARE = 0.35
# The mirror image is summed in steps of a quarter of sigma_b, up to 5 sigma_b from its middle.
_MIRROR_STEP, _MIRROR_ENDS = 0.25, 5.0
_RGB = rgb_from_xyz("Rec.709")


@dataclass(frozen=True)
class Surface:
    """A table split into scattered light and mirror image, and the directions over which integrals are summed.

    directions    (n, 3) unit vectors over the hemisphere around +z
    solid_angles  (n,) steradians"""

    scattering: Table
    mirror: Table
    directions: np.ndarray
    solid_angles: np.ndarray

    @classmethod
    def of(cls, table: Table) -> "Surface":
        """Split a table and choose its directions."""
        mirror = replace(table, terms=np.zeros_like(table.terms), wider=())
        return cls(without_mirror(table), mirror, *hemisphere(_STEP * table.sigma_b))

    def scattered(self, wr: np.ndarray) -> np.ndarray:
        """What each direction adds to the radiance (n, 3) towards a viewer at wr (3,), in a world of radiance 1."""
        return _answers(self.scattering, self.directions, wr) * self.solid_angles[:, None]

    def mirrored(self, wr: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The directions (m, 3) of the mirror image towards a viewer at wr (3,), and what each adds, (m, 3).

        The cosine of the irradiance cancels the cosine in the solid angle, so that nothing diverges at the horizon."""
        sigma, sine = self.mirror.sigma_b, np.hypot(*wr[:2])
        away = -wr[:2] / sine if sine > 0 else np.array((1.0, 0.0))
        step = _MIRROR_STEP * sigma
        across = np.arange(-_MIRROR_ENDS, _MIRROR_ENDS + _MIRROR_STEP / 2, _MIRROR_STEP)[:, None] * sigma
        across = across[np.abs(across[:, 0]) < 1]
        rim = np.sqrt(1 - across**2)
        low, high = (np.arcsin(np.clip((sine + sign * _MIRROR_ENDS * sigma) / rim, -1, 1)) for sign in (-1, 1))
        count = int(np.max(high - low) / step) + 1
        angle = low + (high - low) * (np.arange(count) + 0.5) / count
        along, cosine = rim * np.sin(angle), rim * np.cos(angle)
        x, y = along * away[0] - across * away[1], along * away[1] + across * away[0]
        area = step * cosine * (high - low) / count
        wi, area, cosine = np.stack([x, y, cosine], axis=-1).reshape(-1, 3), area.ravel(), cosine.ravel()
        return wi, _answers(self.mirror, wi, wr) * (area / cosine)[:, None]

    def lit(self, wi: np.ndarray, wr: np.ndarray, irradiance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Scattered and mirrored radiance (3,) under lamps at wi (n, 3) of irradiance (n, 3)."""
        above = wi[:, 2] > 0
        tables = self.scattering, self.mirror
        return tuple((_answers(table, wi[above], wr) * irradiance[above]).sum(axis=0) for table in tables)


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
    return replace(table, zero_order=np.zeros_like(table.zero_order))


def _answers(table: Table, wi: np.ndarray, wr: np.ndarray) -> np.ndarray:
    """Linear Rec.709 (n, 3) towards wr (3,) under unit irradiance from wi (n, 3)."""
    return shown_rgb(reflected_xyz(table, wi, np.broadcast_to(wr, wi.shape)), _RGB)


def directional_albedo(table: Table, theta_r: float) -> np.ndarray:
    """Radiance in linear Rec.709 (3,) in a world of radiance 1, seen along T at theta_r radians from the normal.

    It is the integral of lamp_radiance over the hemisphere, so no direction's colour has a negative component. This
    adds light: red and blue orders of a grating are outside of Rec.709, and a component can exceed 1."""
    return _over_hemisphere(table, theta_r, lambda wi, wr: lamp_radiance(table, wi, wr, irradiance=np.ones(3)))


def directional_albedo_xyz(table: Table, theta_r: float) -> np.ndarray:
    """The same as X, Y and Z (3,) over a mirror's, with every colour as it is: at most 1 in each."""
    return _over_hemisphere(table, theta_r, lambda wi, wr: reflected_xyz(table, wi, wr)) / mirror_xyz(table.illuminant)


def _over_hemisphere(
    table: Table, theta_r: float, radiance: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> np.ndarray:
    """The integral (3,) over the hemisphere of lights of the radiance (n, 3) for wi (n, 3) and wr (n, 3).

    The polar angle is integrated by Gauss-Legendre quadrature: equal steps would be off by 1 % at the normal, even at
    half a kernel. Around a ring steps are at most a kernel long: equal steps over a Gaussian are then off by 2 exp(-2
    pi^2) = 5e-9."""
    nodes, weights = np.polynomial.legendre.leggauss(math.ceil(math.pi**2 / 4 / table.sigma_b))
    steps = math.ceil(2 * math.pi / table.sigma_b)
    phi = (np.arange(steps) + 0.5) * (2 * math.pi / steps)
    wr = np.broadcast_to((math.sin(theta_r), 0.0, math.cos(theta_r)), (steps, 3))
    total = np.zeros(3)
    for theta, weight in zip((nodes + 1) * (math.pi / 4), weights * (math.pi / 4), strict=True):
        sine = math.sin(theta)
        wi = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.full(steps, math.cos(theta))], axis=-1)
        total += radiance(wi, wr).sum(axis=0) * (weight * sine)
    return total * (2 * math.pi / steps)
