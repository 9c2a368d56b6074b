# SPDX-License-Identifier: GPL-3.0-or-later
"""A piece of shed skin: the scales of back and sides, cut open along the belly and laid flat."""

from __future__ import annotations

import numpy as np

from ...precompute.base.failure import GratingError
from .body import SIDE_ANGLE
from .lattice import Cut, make_net
from .scales import place
from .shape import LEAST_FACES, MOST_FACES, SKIN, Shape
from .species import SPECIES

# Dry skin is slightly wavy: the height of the waves and the shortest wavelength, in sides of the piece.
_WAVE, _SHORTEST_WAVE = 0.004, 0.35


def shed_shape(species_name: str, *, size: float, faces: int, seed: int = 0) -> Shape:
    """A piece of about `size` x `size` metres on the plane z = 0, of a species in SPECIES, with about `faces` faces. X
    points to the tail and Y around the body, like U and V. Raises GratingError if `faces` is out of range."""
    if not LEAST_FACES <= faces <= MOST_FACES:
        raise GratingError("shed skin", f"{faces} faces", f"give {LEAST_FACES} to {MOST_FACES}")
    species = SPECIES[species_name]
    radius = size / (2 * SIDE_ANGLE)
    unit = radius * species.scale_length
    rng = np.random.default_rng(seed)
    net = make_net(species.rows, _cut(faces, species.rows, size / unit))
    places = place(net, species, flatness=0.0, rng=rng)  # the skin itself is flat
    quads = net.quads[~net.belly]
    used, corners = np.unique(quads, return_inverse=True)
    along, angle, rise, overhang, rim, inside = (part[used] for part in places)
    x, y = unit * along, radius * angle
    points = np.stack([x + unit * overhang, y, unit * rise + _waves(x / size, y / size, rng) * size], axis=1)
    points -= (*(points.min(axis=0) + points.max(axis=0))[:2] / 2, points[:, 2].min())
    corners = corners.reshape(quads.shape)
    uv = np.stack([x / (2 * np.pi * radius), angle / (2 * np.pi) + 0.5], axis=1)
    s = x - x.min()
    scale = net.scale[~net.belly]
    return Shape(
        points=points,
        corners=corners.ravel(),
        starts=np.arange(0, corners.size, 4),
        uv=uv[corners].reshape(-1, 2),
        material=np.full(len(corners), SKIN),
        edge=inside == 1,
        s=s,
        of_points={"scale_rim": rim, "along": s / s.max(), "around": np.abs(angle) / np.pi},
        of_faces={"scale_random": rng.random(scale.max() + 1)[scale], "belly": np.zeros(len(corners))},
    )


def _cut(faces: int, rows: int, natural: float) -> Cut:
    """The cut with `faces` faces within 4 % whose scales in a row are nearest to `natural`."""
    cuts = []
    for n in range(3, 64):
        # Every other row has one more scale.
        scales = round((faces / n**2 - (rows + 1) / 2) / rows)
        made = (scales * rows + (rows + 1) / 2) * n**2
        if scales > 1 and abs(made / faces - 1) < 0.04:
            cuts.append(Cut(scales, n, belly=2, head=0, tail=0))
    return min(cuts, key=lambda cut: abs(np.log(cut.scales / natural)))


def _waves(x: np.ndarray, y: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Heights of long waves in random directions, at points (v,), in sides of the piece."""
    heights = np.zeros_like(x)
    for _ in range(5):
        direction, phase = rng.uniform(0, 2 * np.pi, 2)
        waves = 2 * np.pi * rng.uniform(0.3, 1) / _SHORTEST_WAVE
        heights += _WAVE * np.sin(waves * (x * np.cos(direction) + y * np.sin(direction)) + phase)
    return heights
