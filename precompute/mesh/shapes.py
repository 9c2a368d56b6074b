# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes that carry a grating: a disc's ring, a ball, a bent sheet and a flat one. Lengths are in metres."""

from math import radians
from typing import NamedTuple

import numpy as np

# Radii of every optical disc: hole, clear ring, data area, rim.
HOLE_M, CLEAR_M, WRITTEN_M, RIM_M = 0.0075, 0.022, 0.058, 0.060
BALL_RADIUS_M = 0.05
# Width and height of the sheet, and the angles from one edge to the other by which it is bent.
SHEET_M, BENDS_DEG = (0.11, 0.1), (60.0, 12.0)
_RING_SEGMENTS, _BALL_SEGMENTS, _SHEET_CELLS = 256, 192, 96


class Shape(NamedTuple):
    """A mesh of quads: points (n, 3), the quads' points (m, 4), and the UVs of the quads' corners (m, 4, 2)."""

    points: np.ndarray
    quads: np.ndarray
    uv: np.ndarray


def ring(inner_m: float, outer_m: float, height_m: float, *, segments: int = _RING_SEGMENTS) -> Shape:
    """A flat ring around the z axis that faces upwards. U is radius / RIM_M, V the turn."""
    turn = np.arange(segments + 1) / segments
    around = np.stack([np.cos(2 * np.pi * turn[:-1]), np.sin(2 * np.pi * turn[:-1])], axis=-1)
    points = np.concatenate([np.c_[r * around, np.full(segments, height_m)] for r in (inner_m, outer_m)])
    k, after = np.arange(segments), (np.arange(segments) + 1) % segments
    u = np.array([inner_m, outer_m, outer_m, inner_m]) / RIM_M
    v = np.stack([turn[:-1], turn[:-1], turn[1:], turn[1:]], axis=-1)
    quads = np.stack([k, k + segments, after + segments, after], axis=-1)
    return Shape(points, quads, np.stack([np.broadcast_to(u, v.shape), v], axis=-1))


def ball(radius_m: float = BALL_RADIUS_M, *, segments: int = _BALL_SEGMENTS) -> Shape:
    """A ball that stands on the origin. U runs round its vertical axis, V from the bottom to the top."""
    turn, height = np.meshgrid(
        np.linspace(0, 2 * np.pi, segments + 1), np.linspace(-np.pi / 2, np.pi / 2, segments // 2 + 1)
    )
    flat = np.cos(height)
    points = radius_m * np.stack([flat * np.cos(turn), flat * np.sin(turn), 1 + np.sin(height)], axis=-1)
    return of_grid(points, np.stack([turn / (2 * np.pi), height / np.pi + 0.5], axis=-1))


def bent_sheet(cells: int = _SHEET_CELLS) -> Shape:
    """A sheet whose middle is the origin. It bends away from z along both sides. U runs along x."""
    u, v = np.meshgrid(np.linspace(0, 1, cells), np.linspace(0, 1, cells))
    turns = [radians(bend) * (share - 0.5) for bend, share in zip(BENDS_DEG, (u, v), strict=True)]
    spans = [size / radians(bend) for size, bend in zip(SHEET_M, BENDS_DEG, strict=True)]
    drop = sum(span * (1 - np.cos(turn)) for span, turn in zip(spans, turns, strict=True))
    points = np.stack([*(span * np.sin(turn) for span, turn in zip(spans, turns, strict=True)), -drop], axis=-1)
    return of_grid(points, np.stack([u, v], axis=-1))


def flat_sheet(width: float, height: float, *, cells: int) -> Shape:
    """A flat rectangle around the origin that faces z. U runs along x."""
    u, v = np.meshgrid(np.linspace(0, 1, cells + 1), np.linspace(0, 1, cells + 1))
    points = np.stack([width * (u - 0.5), height * (v - 0.5), np.zeros_like(u)], axis=-1)
    return of_grid(points, np.stack([u, v], axis=-1))


def of_grid(points: np.ndarray, uv: np.ndarray) -> Shape:
    """The quads of a grid of points (rows, columns, 3) with UVs (rows, columns, 2)."""
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4)
    return Shape(points.reshape(-1, 3), quads, uv.reshape(-1, 2)[quads])
