# SPDX-License-Identifier: GPL-3.0-or-later
"""The scattered light of a whole sphere in the camera's picture.

A surface shows a small sun as streaks that are narrower than the distance of a few hundred points. The light of 120
points of a sphere under one sun has a standard error of 17 %, although each point is exact. So the light of a render is
measured over all of the picture, and compared with a mean over many pairs of a point and a direction. No pair uses
sources or closures.

The light of the panorama comes from directions that are drawn by the table: (u, v) in proportion to the scattered light
of one w, at random points. The small bright lights are gathered in cells of about 3 degrees. Each cell shines from its
middle on points of its own, in proportion to its light. The points follow a Kronecker sequence, which fills the picture
evenly. The error comes from random shifts of the sequence.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from precompute.colour.spaces import rgb_from_xyz, shown_rgb
from precompute.table.radiance import reflected_xyz
from precompute.table.table import Table

from . import lights_scenes as scenes
from .lights_truth import LUMINANCE

# Shifts of the sequence, and the points of each, evaluated a block at a time.
_SHIFTS, _POINTS, _BLOCK = 8, 400_000, 50_000
# The step of the sequence in each dimension (Roberts 2018): powers of 1 over the root of x^3 = x + 1.
_STEPS = 1.324717957244746 ** -np.array((1.0, 2.0))
# Cells in which small lights are gathered, of the unit vector's components.
_CELL = 0.05
# The grid of (u, v) from -2 to 2, the w of its density, and the share of the draws that are even.
_GRID, _W, _EVEN = 400, 1.5, 0.1
_RGB = rgb_from_xyz("Rec.709")


@dataclass(frozen=True)
class Sphere:
    """Points of a sphere around 0, uniform in the camera's picture, as in lights_scenes.Points."""

    positions: np.ndarray
    frames: np.ndarray
    views: np.ndarray


def sphere_points(camera, places: np.ndarray) -> tuple[np.ndarray, Sphere]:
    """Which places (n, 2), from 0 to 1 in the square picture of a Blender camera, show the sphere of
    lights_scenes.build, and the points that they show."""
    at, turn = np.array(camera.location), np.array(camera.rotation_euler.to_matrix())
    across = (2 * places - 1) * np.tan(camera.data.angle / 2)
    rays = np.column_stack([across, np.full(len(places), -1.0)]) @ turn.T
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    middle = -rays @ at
    below = at @ at - middle**2
    hit = below < scenes.RADIUS_M**2
    positions = at + (middle - np.sqrt(np.maximum(scenes.RADIUS_M**2 - below, 0)))[:, None] * rays
    normals = positions[hit] / np.linalg.norm(positions[hit], axis=1, keepdims=True)
    tangents = np.cross((0, 0, 1), normals)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    frames = np.stack([tangents, np.cross(normals, tangents), normals], axis=1)
    views = np.einsum("nij,nj->ni", frames, -rays[hit])
    # Rounding makes a cosine greater than 1, for which the reflectance is wrong.
    return hit, Sphere(positions[hit], frames, np.clip(views, -1, 1))


def mean_light(camera, table: Table, light: scenes.Light) -> tuple[float, float]:
    """The mean Y over the camera's picture of a sphere with this table under a light, and its standard error."""
    random = np.random.default_rng(11)
    draws: list[_Draws] = []
    if light.square is not None:
        draws.append(_LampDraws(light, random))
    if light.panorama.any():
        draws.append(_TableDraws(table, light.panorama, random))
    if len(light.directions):
        draws.append(_SmallDraws(light))
    means = [sum(_mean(camera, table, each, random.uniform(size=2)) for each in draws) for _ in range(_SHIFTS)]
    return float(np.mean(means)), float(np.std(means, ddof=1) / np.sqrt(_SHIFTS))


def _mean(camera, table: Table, draws: _Draws, shift: np.ndarray) -> float:
    total = 0.0
    for first in range(0, _POINTS, _BLOCK):
        numbers = np.arange(first, first + _BLOCK)
        hit, sphere = sphere_points(camera, (shift + numbers[:, None] * _STEPS) % 1)
        total += _sent(table, sphere, *draws.drawn(numbers[hit] / _POINTS, sphere))
    return total / _POINTS


def _sent(table: Table, sphere: Sphere, wi: np.ndarray, irradiance: np.ndarray) -> float:
    """The sum of the Y that the points send to the camera, each lit from one direction in its tangent frame."""
    lit = (wi[:, 2] > 0) & (sphere.views[:, 2] > 0) & irradiance.any(axis=1)
    rgb = shown_rgb(reflected_xyz(table, wi[lit], sphere.views[lit]), _RGB)
    return float((rgb * irradiance[lit] @ LUMINANCE).sum())


class _Draws(Protocol):
    def drawn(self, places: np.ndarray, sphere: Sphere) -> tuple[np.ndarray, np.ndarray]:
        """For each point of a sphere a direction (n, 3) in its tangent frame, and the irradiance (n, 3) that it stands
        for. `places` (n,) go from 0 to 1 in the order of the points."""


class _TableDraws:
    """Directions of a panorama's light, in proportion to the light that the table scatters at one w."""

    def __init__(self, table: Table, panorama: np.ndarray, random: np.random.Generator) -> None:
        self._panorama, self._random = panorama, random
        self._step = 4 / _GRID
        axis = (np.arange(_GRID) + 0.5) * self._step - 2
        u, v = (each.ravel() for each in np.meshgrid(axis, axis))
        inside = (u**2 + v**2 < 4) & table.holds(u, v, np.full(len(u), _W))
        density = np.zeros(len(u))
        density[inside] = np.maximum(table.scattered_over_w2(u[inside], v[inside], np.full(inside.sum(), _W))[:, 1], 0)
        density = (1 - _EVEN) * density / density.sum() + _EVEN * (u**2 + v**2 < 4) / (u**2 + v**2 < 4).sum()
        self._u, self._v, self._density, self._along = u, v, density, np.cumsum(density)

    def drawn(self, places: np.ndarray, sphere: Sphere) -> tuple[np.ndarray, np.ndarray]:
        chosen, *inside = self._random.uniform(size=(3, len(places)))
        which = np.minimum(np.searchsorted(self._along, chosen * self._along[-1]), len(self._along) - 1)
        x, y = (
            middle[which] + (offset - 0.5) * self._step - sphere.views[:, axis]
            for axis, (middle, offset) in enumerate(zip((self._u, self._v), inside, strict=True))
        )
        squared = 1 - x**2 - y**2
        wi = np.stack([x, y, np.sqrt(np.maximum(squared, 1e-12))], axis=1)
        radiance = scenes.looked_up(self._panorama, np.einsum("nij,ni->nj", sphere.frames, wi))
        # du dv = cos(ti) dwi
        weight = np.where(squared > 1e-9, self._step**2 / self._density[which] / wi[:, 2], 0)
        return wi, radiance * weight[:, None]


class _SmallDraws:
    """Small lights, gathered in cells, one after another."""

    def __init__(self, light: scenes.Light) -> None:
        cells, which = np.unique(np.floor(light.directions / _CELL), axis=0, return_inverse=True)
        irradiance, towards = np.zeros((2, len(cells), 3))
        np.add.at(irradiance, which.ravel(), light.irradiance)
        np.add.at(towards, which.ravel(), light.directions * light.irradiance.sum(axis=1)[:, None])
        lit = irradiance.any(axis=1)
        self._directions = towards[lit] / np.linalg.norm(towards[lit], axis=1, keepdims=True)
        self._irradiance = irradiance[lit]
        self._share = self._irradiance.sum(axis=1) / self._irradiance.sum()
        self._along = np.cumsum(self._share)

    def drawn(self, places: np.ndarray, sphere: Sphere) -> tuple[np.ndarray, np.ndarray]:
        which = np.minimum(np.searchsorted(self._along, places), len(self._along) - 1)
        wi = np.einsum("nij,nj->ni", sphere.frames, self._directions[which])
        return wi, self._irradiance[which] / self._share[which][:, None]


class _LampDraws:
    """Points of a square lamp."""

    def __init__(self, light: scenes.Light, random: np.random.Generator) -> None:
        self._square, self._random = light.square, random

    def drawn(self, places: np.ndarray, sphere: Sphere) -> tuple[np.ndarray, np.ndarray]:
        middle, axes = self._square
        inside = self._random.uniform(-0.5, 0.5, size=(len(places), 2))
        away = middle + scenes.LAMP_M * inside @ axes[:2] - sphere.positions
        distance = np.linalg.norm(away, axis=1, keepdims=True)
        facing = np.maximum((away / distance) @ axes[2], 0)[:, None]  # a lamp shines along its -z
        irradiance = np.repeat(scenes.LAMP_W / np.pi * facing / distance**2, 3, axis=1)
        return np.einsum("nij,nj->ni", sphere.frames, away / distance), irradiance
