# SPDX-License-Identifier: GPL-3.0-or-later
"""Singularities of a direction field: the index of each triangle, and edges across which the field flips."""

from dataclasses import dataclass

import numpy as np

from .surface import Surface, following

# A field that turns by more than a right angle across one edge is not smooth.
_FLIP = np.pi / 2


@dataclass(frozen=True)
class Singular:
    """index  (m,) how often the field turns around each triangle, against the surface: 0 where it is regular. On a
              closed surface the sum is the Euler characteristic (Poincaré and Hopf)
    torn   (m,) whether the field flips across an edge of the triangle although its index is 0"""

    index: np.ndarray
    torn: np.ndarray


def singular_triangles(surface: Surface, direction: np.ndarray) -> Singular:
    """Find the singular triangles of a direction field (nodes,)."""
    turns = edge_turns(surface, direction).reshape(-1, 3)
    index = np.rint((turns.sum(axis=1) + surface.curvature) / (2 * np.pi)).astype(int)
    near = np.bincount(surface.node, np.repeat(index != 0, 3), surface.node_count)[surface.node] > 0
    torn = (np.abs(turns) > _FLIP).any(axis=1) & ~near.reshape(-1, 3).any(axis=1)
    return Singular(index, torn)


def edge_turns(surface: Surface, direction: np.ndarray) -> np.ndarray:
    """The angle (3 m,), from -pi to pi, by which a field turns along each corner's edge."""
    here = surface.node
    there = here[following(np.arange(len(here)))]
    return np.angle(direction[there] * np.conj(surface.transport * direction[here]))
