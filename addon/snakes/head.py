# SPDX-License-Identifier: GPL-3.0-or-later
"""The relief of a snake's head (plates, mouth and nostrils), and its eyes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from . import head_plates
from .body import SPECIES, Species, smoothstep
from .head_plates import LIP_DEG, MOUTH_DEG, Corner, Plates

# The end of the line of the mouth, and how far it rises up to there, in degrees.
_MOUTH_END, _MOUTH_RISE_DEG = 0.76, 7.0
_NOSTRIL = (0.115, np.radians(63))
# In the body's largest half widths: widths of a plate's rounded edge, of the groove between plates, of pale rims, of
# the fold of the mouth and of the lips around it; radius of a nostril; depths.
_EDGE, _GROOVE, _RIM, _MOUTH, _LIPS, _NOSTRIL_RADIUS = 0.06, 0.03, 0.045, 0.04, 0.12, 0.03
_EDGE_DEPTH, _GROOVE_DEPTH, _MOUTH_DEPTH, _LIP_HEIGHT, _NOSTRIL_DEPTH = 0.004, 0.006, 0.05, 0.012, 0.05
# How pale the edges of plates are; scales of the body have 1.
_PALE = 0.45
# The socket around an eye, in radii of the eye, and its depth in the body's half widths.
_SOCKET, _SOCKET_DEPTH = 1.5, 0.03


class Head(NamedTuple):
    """The head of a species: plates; an eye's share of the head's length, its angle from the head's top, its radius in
    the body's largest half widths, and the depth of its centre under the skin in its radii."""

    plates: Plates
    eye_share: float
    eye_angle: float
    eye_radius: float
    eye_depth: float


# Xenopeltis has small eyes far in front, Elaphe large ones that stand out.
_HEADS = {
    "XENOPELTIS": Head(head_plates.XENOPELTIS, 0.335, np.radians(66), 0.085, 0.5),
    "ELAPHE": Head(head_plates.ELAPHE, 0.335, np.radians(66), 0.135, 0.45),
}


class Relief(NamedTuple):
    """At points on a head (n,): height in the body's largest half widths, pale rim and pale lip (0 to 1), and plate
    number."""

    rise: np.ndarray
    rim: np.ndarray
    lip: np.ndarray
    plate: np.ndarray


def head_of(species: Species) -> Head:
    """The head of a species; that of Xenopeltis for one that is not in SPECIES."""
    return next((_HEADS[name] for name, known in SPECIES.items() if known == species), _HEADS["XENOPELTIS"])


def relief(share: np.ndarray, angle: np.ndarray, head: Head, *, length: float) -> Relief:
    """The relief at shares of a head's length and angles from the midline of its top, both (n,). `length`: the head's,
    in the body's largest half widths."""
    angle = np.angle(np.exp(1j * angle))
    side, angle = angle < 0, np.abs(angle)
    x, y = _flat(share, angle, length)
    to_edge, plate = _to_edge(x, y, head.plates, length)
    whole = head.plates.lie_on_midline
    plate = np.where(side & ~whole[plate], plate + len(whole), plate)
    # The same angle is a shorter distance where the snout is thin.
    radius = _radius(share)
    mouth = _mouth_angle(share)
    below = radius * (angle - mouth)
    within = _hill(length * np.maximum(share - _MOUTH_END, 0) / 0.15)
    nostril = np.hypot(length * (share - _NOSTRIL[0]), radius * (angle - _NOSTRIL[1]))
    eye = np.hypot(length * (share - head.eye_share), radius * (angle - head.eye_angle)) / head.eye_radius
    rise = -_EDGE_DEPTH * np.clip(1 - to_edge / _EDGE, 0, 1) ** 2 - _GROOVE_DEPTH * _hill(to_edge / _GROOVE)
    # The upper lip hangs over the lower one.
    rise = rise + within * (_LIP_HEIGHT * _hill(below / _LIPS) * np.where(below < 0, 1.0, -0.5))
    fold = within * _hill((below - 0.4 * _MOUTH) / _MOUTH)
    rise = rise - _MOUTH_DEPTH * fold
    rise = rise - _NOSTRIL_DEPTH * _hill(nostril / _NOSTRIL_RADIUS) - _SOCKET_DEPTH * _hill(eye / _SOCKET)
    upper = smoothstep((angle - np.radians(LIP_DEG) - 0.05) / 0.12)
    # The skin in the fold of the mouth is dark.
    lip = (
        (1 - fold) * upper * smoothstep((np.radians(MOUTH_DEG + 24) - angle) / 0.2) * smoothstep((0.86 - share) / 0.12)
    )
    return Relief(rise, _PALE * _hill(to_edge / _RIM), lip, plate)


def _flat(share: np.ndarray, angle: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Places on one half of the head, unrolled: along it and around it from the midline, in half widths."""
    return length * share, _radius(share) * angle


def _radius(share: np.ndarray) -> np.ndarray:
    """The radius of the head in half widths."""
    return 0.7 * np.sqrt(np.clip(share / 0.2, 0, 1))


def _mouth_angle(share: np.ndarray) -> np.ndarray:
    """The angle of the line of the mouth, which rises towards its corner."""
    return np.radians(MOUTH_DEG - _MOUTH_RISE_DEG * smoothstep((share - 0.3) / (_MOUTH_END - 0.3)))


def _to_edge(x: np.ndarray, y: np.ndarray, plates: Plates, length: float) -> tuple[np.ndarray, np.ndarray]:
    """The distance to the edge of the plate or scale at each place (n,), in half widths, and its number."""
    small = np.stack(_flat(plates.small[:, 0], np.radians(plates.small[:, 1]), length), axis=1)
    apart = np.hypot(x[:, None] - small[:, 0], y[:, None] - small[:, 1])
    first, second = np.partition(apart, 1, axis=1)[:, :2].T
    number, to_edge = len(plates.outlines) + apart.argmin(axis=1), (second - first) / 2
    outside = np.full(len(x), np.inf)
    inside_any = np.zeros(len(x), bool)
    for index, outline in enumerate(plates.outlines):
        inside, distance = _outline(x, y, outline, length, open_at_midline=index < plates.on_midline)
        number, to_edge = np.where(inside, index, number), np.where(inside, distance, to_edge)
        inside_any |= inside
        outside = np.minimum(outside, distance)
    return np.where(inside_any, to_edge, np.minimum(to_edge, outside)), number


def _outline(
    x: np.ndarray, y: np.ndarray, corners: Iterable[Corner], length: float, *, open_at_midline: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Whether places (n,) lie inside an outline, and their distance to it."""
    share, degrees = np.array(tuple(corners), float).T
    u, v = _flat(share, np.radians(degrees), length)
    inside, distance = np.zeros(len(x), bool), np.full(len(x), np.inf)
    for k in range(len(u)):
        j = (k + 1) % len(u)
        crosses = (v[k] > y) != (v[j] > y)
        inside ^= crosses & (x < (u[j] - u[k]) * (y - v[k]) / (v[j] - v[k] or 1.0) + u[k])
        if open_at_midline and degrees[k] == degrees[j] == 0:
            continue
        du, dv = u[j] - u[k], v[j] - v[k]
        t = np.clip(((x - u[k]) * du + (y - v[k]) * dv) / max(du * du + dv * dv, 1e-12), 0, 1)
        distance = np.minimum(distance, np.hypot(x - u[k] - t * du, y - v[k] - t * dv))
    return inside, distance


def _hill(x: np.ndarray) -> np.ndarray:
    """A smooth bump: 1 at 0, and 0 from 1 on."""
    return (1 - np.clip(np.abs(x), 0, 1) ** 2) ** 2
