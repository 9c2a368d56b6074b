# SPDX-License-Identifier: GPL-3.0-or-later
"""The relief of a snake's head (plates, mouth and nostrils), and its eyes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# Centres of the head's plates: share of the head's length from the snout, and degrees from the midline of its top. Each
# plate off the midlines has a mirror image on the other side.
_PLATES = np.array((
    (0.00, 0), (0.11, 20), (0.10, 55), (0.25, 24), (0.26, 62), (0.46, 0), (0.45, 36), (0.56, 66), (0.70, 22),
    (0.72, 58), (0.88, 0), (0.90, 38), (0.05, 80), (0.17, 84), (0.29, 86), (0.41, 87), (0.54, 88), (0.68, 88),
    (0.84, 84), (0.06, 128), (0.18, 122), (0.31, 120), (0.45, 119), (0.60, 118), (0.76, 118), (0.92, 118),
    (0.04, 180), (0.20, 158), (0.42, 156), (0.64, 158), (0.84, 160), (0.52, 180), (0.74, 180), (0.94, 180),
))  # fmt: skip
# The line of the mouth: its angle from the top, and its end.
_MOUTH_ANGLE, _MOUTH_END = np.radians(103), 0.74
_NOSTRIL, _EYE = (0.085, np.radians(58)), (0.37, np.radians(63))
# In the body's largest half widths: half widths of the grooves, pale rims and mouth, radii of nostril and eye, depths.
_GROOVE, _RIM, _MOUTH, _NOSTRIL_RADIUS, _EYE_RADIUS = 0.018, 0.05, 0.035, 0.045, 0.12
_GROOVE_DEPTH, _MOUTH_DEPTH, _NOSTRIL_DEPTH = 0.012, 0.035, 0.05
# The depth of an eye's centre under the skin, in its radii.
_EYE_DEPTH = 0.45


class Relief(NamedTuple):
    """At points on a head (n,): height in the body's largest half widths, pale rim (0 to 1), and plate number."""

    rise: np.ndarray
    rim: np.ndarray
    plate: np.ndarray


def relief(share: np.ndarray, angle: np.ndarray, *, length: float) -> Relief:
    """The relief at shares of a head's length and angles from the midline of its top, both (n,). `length`: the head's,
    in the body's largest half widths."""
    angle = np.angle(np.exp(1j * angle))
    middles = np.radians(_PLATES[:, 1])
    twins = (_PLATES[:, 1] > 0) & (_PLATES[:, 1] < 180)
    along = np.concatenate([_PLATES[:, 0], _PLATES[twins, 0]])
    around = np.concatenate([middles, -middles[twins]])
    # The snout is thin, so the same angle is a shorter distance there.
    radius = 0.7 * np.sqrt(np.clip(share / 0.2, 0, 1))[:, None]
    apart = np.hypot(length * (share[:, None] - along), radius * np.angle(np.exp(1j * (angle[:, None] - around))))
    nearest = np.argpartition(apart, 1, axis=1)[:, :2]
    first, second = np.sort(np.take_along_axis(apart, nearest, axis=1), axis=1).T
    plate = apart.argmin(axis=1)
    to_edge = (second - first) / 2
    mouth = np.abs(np.abs(angle) - _MOUTH_ANGLE) * 0.7 + length * np.maximum(share - _MOUTH_END, 0)
    nostril = np.hypot(length * (share - _NOSTRIL[0]), 0.5 * (np.abs(angle) - _NOSTRIL[1]))
    rise = -_GROOVE_DEPTH * _hill(to_edge / _GROOVE) - _MOUTH_DEPTH * _hill(mouth / _MOUTH)
    rise -= _NOSTRIL_DEPTH * _hill(nostril / _NOSTRIL_RADIUS)
    return Relief(rise, _hill(to_edge / _RIM), plate)


def eye_places() -> tuple[float, float, float, float]:
    """An eye's share of the head's length, its angle from the head's top, its radius, and the depth of its centre under
    the skin; the last two in the body's largest half widths."""
    return *_EYE, _EYE_RADIUS, _EYE_DEPTH * _EYE_RADIUS


def _hill(x: np.ndarray) -> np.ndarray:
    """A smooth bump: 1 at 0, and 0 from 1 on."""
    return (1 - np.clip(np.abs(x), 0, 1) ** 2) ** 2
