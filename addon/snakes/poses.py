# SPDX-License-Identifier: GPL-3.0-or-later
"""Poses of a snake: control polygons of the line under its belly, from snout to tail. The unit is about the radius of a
body that is 80 radii long; the floor is z = 0."""

import numpy as np

from .spine import Spine, spine_along

# A head laid over the first bend, and four runs side by side.
_RESTING = (
    (-6.4, -6.6, 0), (-7.4, -5.4, 0), (-7.9, -3.9, 0), (-7.8, -2.2, 0.3), (-6.9, -0.8, 1.5), (-5.4, 0.2, 2.3),
    (-3.6, 0.8, 1.9), (-1.8, 1.2, 0.6), (0, 1.4, 0), (1.6, 1.5, 0), (3.3, 1.2, 0), (4.6, 0.0, 0), (4.6, -1.8, 0),
    (3.2, -2.9, 0), (1, -3.1, 0), (-1.5, -3.1, 0), (-3.8, -2.8, 0), (-5.6, -1.4, 0), (-5.6, 1.2, 0), (-4.2, 3.4, 0),
    (-1.5, 4.4, 0), (1.5, 4.6, 0), (4.4, 4.2, 0), (6.8, 2.6, 0), (7.6, -0.2, 0), (6.8, -2.9, 0), (4.6, -5.0, 0),
    (1.5, -5.8, 0), (-1.5, -6.0, 0), (-4.2, -6.4, 0),
)  # fmt: skip
# The neck stands in an S and the head faces forwards; the body winds away behind.
_REARING = (
    (-5.6, 0, 9.2), (-4.2, 0, 9.4), (-2.7, 0, 9.5), (-1.2, 0, 9.1), (-0.2, 0, 8.0), (0.2, 0, 6.5), (0, 0, 4.9),
    (-0.2, 0, 3.3), (0.1, 0, 1.8), (1.2, 0, 0.6), (2.8, 0, 0.05), (4.6, 0.3, 0), (7, 1.4, 0), (9.6, 3.8, 0),
    (12.4, 5.4, 0), (15.4, 4.8, 0), (17.4, 2.2, 0), (18.6, -1.2, 0), (20.6, -4.2, 0), (23.6, -5.4, 0), (26.6, -4.2, 0),
    (28.6, -1.2, 0), (30.4, 2, 0), (33, 4, 0), (36, 3.8, 0), (38.6, 2, 0), (41, 0, 0), (44, -1, 0), (47, -0.6, 0),
)  # fmt: skip


def _spiral() -> np.ndarray:
    """A flat coil with the head in its middle. The turns are 2.1 radii apart; the first is as tight as a body bends."""
    turns = np.linspace(0, 4.8 * np.pi, 60)
    r = 2.7 + 2.1 * turns / (2 * np.pi)
    return np.stack([r * np.cos(turns), r * np.sin(turns), 0 * r], axis=1)


def _waves() -> np.ndarray:
    """Three and a half bends from side to side, smaller towards the head."""
    t = np.linspace(0, 1, 60)
    bend = 4.2 * np.sin(2 * np.pi * 1.75 * t) * np.minimum(1, 0.35 + 2 * t)
    return np.stack([40 * t - 20, bend, 0 * t], axis=1)


POSES = {
    "COILED": _spiral(),
    "S": _waves(),
    "RESTING": np.array(_RESTING, float),
    "REARING": np.array(_REARING, float),
}


def posed_spine(pose: str, length_m: float) -> Spine:
    """The spine of a pose, centred over the origin, with its lowest point at z = 0."""
    spine = spine_along(POSES[pose], length_m)
    low, high = spine.points.min(axis=0), spine.points.max(axis=0)
    return spine._replace(points=spine.points - (*(low + high)[:2] / 2, low[2]))
