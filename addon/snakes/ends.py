# SPDX-License-Identifier: GPL-3.0-or-later
"""The ends that close the net of scales: rings of the head, rings of the tail's end, and two eyes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from . import head
from .body import Body, smoothstep, unit
from .scales import Net

_EYE_RINGS, _EYE_SEGMENTS = 10, 32
EYE_FACES = 2 * _EYE_RINGS * _EYE_SEGMENTS


class Skin(NamedTuple):
    """Vertices (v,) of the skin: arc length from the snout (m), angle around the body, rise over the smooth body (m),
    overhang tailwards (m), pale rim and pale lip (0 to 1), and whether it is on the outer edge of a scale."""

    s: np.ndarray
    angle: np.ndarray
    rise: np.ndarray
    overhang: np.ndarray
    rim: np.ndarray
    lip: np.ndarray
    edge: np.ndarray


class End(NamedTuple):
    """Appended vertices, and faces (f, 4) over all; triangles repeat their first corner. `plate` (f,): head plates."""

    skin: Skin
    faces: np.ndarray
    plate: np.ndarray


def head_end(body: Body, net: Net, scales: Skin) -> End:
    """The head: rings from the snout to the first scales, connected to the vertices of the net."""
    front_s, front_angle = scales.s[net.front], np.unwrap(scales.angle[net.front])
    rings = np.arange(1, net.cut.head)[:, None] / net.cut.head
    # The snout is round, so the rings are closer there.
    s = body.head_end * (0.35 * rings + 0.65 * rings**1.7)
    near = smoothstep((rings - 0.3) / 0.7)
    s = s * (1 + near * (front_s / body.head_end - 1))
    # The belly's midline, where the UV map is cut, continues straight.
    middle = len(front_angle) - net.cut.belly // 2
    even = np.pi + (np.arange(len(front_angle)) - middle) * 2 * np.pi / len(front_angle)
    angle = even + near * (front_angle - even)
    kind = head.head_of(body.species)
    relief = head.relief((s / body.head_end).ravel(), angle.ravel(), kind, length=body.species.head_length)
    # The relief fades out before the first scales, and at the tip, where the rings are smaller than the relief.
    fade = (smoothstep((1 - rings) / 0.1) * smoothstep(rings / 0.08) + 0 * s).ravel()
    skin = Skin(
        s.ravel(), angle.ravel(), body.radius * relief.rise * fade, np.zeros(s.size), relief.rim, relief.lip,
        np.zeros(s.size, bool),
    )  # fmt: skip
    grid = np.concatenate([len(scales.s) + np.arange(s.size).reshape(s.shape), net.front[None]])
    faces, skin = _closed(grid, skin, tip_s=0.0, first=len(scales.s), at_end=False)
    plate = np.concatenate([relief.plate, [0]])[np.clip(faces[:, 0] - len(scales.s), 0, s.size)]
    return End(skin, faces, plate)


def tail_end(body: Body, net: Net, scales: Skin, *, first: int) -> End:
    """The end of the tail: rings from the last scales to the tip. `first` is the index of its first vertex."""
    rear_s, rear_angle = scales.s[net.rear], np.unwrap(scales.angle[net.rear])
    rings = np.arange(1, net.cut.tail)[:, None] / net.cut.tail
    length = body.spine.length
    s = rear_s + (length - rear_s) * (1 - (1 - rings) ** 1.6)
    angle = rear_angle + 0 * s
    zeros = np.zeros(s.size)
    skin = Skin(s.ravel(), angle.ravel(), zeros, zeros, zeros, zeros, zeros > 0)
    grid = np.concatenate([net.rear[None], first + np.arange(s.size).reshape(s.shape)])
    faces, skin = _closed(grid, skin, tip_s=length, first=first, at_end=True)
    return End(skin, faces, np.zeros(len(faces), int))


class Eyes(NamedTuple):
    """Two balls that stand half out of the head: points (v, 3) in metres; faces (f, 4), where a triangle repeats its
    first corner; UVs (f, 4, 2), oriented like the skin's; how far a point is turned outwards (v,), 1 in the middle of
    the pupil; and their arc length in metres."""

    points: np.ndarray
    faces: np.ndarray
    uv: np.ndarray
    gaze: np.ndarray
    s: float


def eyes(body: Body) -> Eyes:
    """The eyes of a body."""
    kind = head.head_of(body.species)
    share, angle, radius = kind.eye_share * body.head_end, kind.eye_angle, kind.eye_radius * body.radius
    depth = kind.eye_depth * radius
    spine = body.spine
    middle = body.points(np.full(2, share), np.array((angle, -angle)), np.full(2, -depth))
    tail, side, back = (np.array([np.interp(share, spine.s, part[:, k]) for k in range(3)]) for part in spine[2:])
    polar = np.pi * np.arange(1, _EYE_RINGS)[:, None] / _EYE_RINGS
    turn = 2 * np.pi * np.arange(_EYE_SEGMENTS) / _EYE_SEGMENTS
    polar, turn = polar + 0 * turn, turn + 0 * polar
    ball = np.concatenate([
        (-np.cos(polar)[..., None] * tail + np.sin(polar)[..., None] * (
            np.sin(turn)[..., None] * side + np.cos(turn)[..., None] * back)).reshape(-1, 3),
        [-tail, tail],
    ])  # fmt: skip
    grid = np.arange((_EYE_RINGS - 1) * _EYE_SEGMENTS).reshape(_EYE_RINGS - 1, _EYE_SEGMENTS)
    snout, end = grid.size, grid.size + 1
    faces = np.concatenate([
        _tips(grid[0], snout, at_end=False), _quads(grid), _tips(grid[-1], end, at_end=True)
    ])  # fmt: skip
    places = np.concatenate([np.stack([-np.cos(polar), turn], axis=-1).reshape(-1, 2), [(-1, 0), (1, 0)]])
    at = places[faces]
    at[..., 1] = unwrapped(at[..., 1], np.isin(faces, (snout, end)))
    # On the UV map beside the skin's snout end, one eye above the other.
    size = radius / body.radius / (2 * np.pi)
    uv = at * size + (-2 * size, 0.25)
    points = (middle[:, None] + radius * ball).reshape(-1, 3)
    # A snake looks to its sides and a little ahead and up.
    gaze = np.concatenate([ball @ unit(sign * side + 0.25 * back - 0.2 * tail) for sign in (1, -1)])
    faces = np.concatenate([faces, faces + len(ball)])
    return Eyes(points, faces, np.concatenate([uv, uv + (0, 0.5)]), np.clip(gaze / gaze.max(), 0, 1), share)


def unwrapped(angle: np.ndarray, at_tip: np.ndarray) -> np.ndarray:
    """The angles (f, 4) of the corners of faces, without jumps within a face, and with their middle in -pi to pi. A
    corner at a tip, where all angles meet, gets the middle of the others."""
    others = ~at_tip
    some = np.take_along_axis(angle, others.argmax(axis=1)[:, None], axis=1)
    angle = angle - 2 * np.pi * np.round((angle - some) / (2 * np.pi))
    # A triangle given as a quad repeats its first corner, so the middle is taken between the extremes.
    low = np.where(others, angle, np.inf).min(axis=1, keepdims=True)
    high = np.where(others, angle, -np.inf).max(axis=1, keepdims=True)
    middle = (low + high) / 2
    angle = np.where(at_tip, middle, angle)
    return angle - 2 * np.pi * np.round(middle / (2 * np.pi))


def _closed(
    grid: np.ndarray, skin: Skin, *, tip_s: float, first: int, at_end: bool
) -> tuple[np.ndarray, Skin]:  # fmt: skip
    """The faces of a grid of rings (k, r) that ends in a tip, and the vertices with the tip appended."""
    tip = first + len(skin.s)
    fan = _tips(grid[-1 if at_end else 0], tip, at_end=at_end)
    closing = (tip_s, 0.0, 0.0, 0.0, 0.0, 0.0, False)
    skin = Skin(*(np.append(values, value).astype(values.dtype) for values, value in zip(skin, closing, strict=True)))
    return np.concatenate([_quads(grid), fan]), skin


def _quads(grid: np.ndarray) -> np.ndarray:
    """Faces (f, 4) between the rings of a grid (k, r), counter-clockwise from outside."""
    beside = np.roll(grid, -1, axis=1)
    return np.stack([grid[:-1], grid[1:], beside[1:], beside[:-1]], axis=-1).reshape(-1, 4)


def _tips(ring: np.ndarray, tip: int, *, at_end: bool) -> np.ndarray:
    """Triangles (r, 4) between a ring (r,) and a tip, with the first corner repeated."""
    beside, tips = np.roll(ring, -1), np.full(len(ring), tip)
    corners = (ring, tips, beside, ring) if at_end else (tips, ring, beside, tips)
    return np.stack(corners, axis=-1)
