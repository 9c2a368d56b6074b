# SPDX-License-Identifier: GPL-3.0-or-later
"""The smooth body under the scales: its half widths and heights, and the positions of points on its skin."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .species import Species
from .spine import Spine, bspline, smoothstep

# Half heights of the body above and below its widest place, in half widths.
_BACK, _BELLY = 0.84, 0.66
# The exponent of a section's superellipse; 2 would be an ellipse. A resting body is slightly flatter on its back and
# flanks, so that the light of one order spreads over more of it.
_SECTION = 2.9
# A body's girth varies by this share, in waves of a third and an eighth of its length.
_GIRTH = 0.02
# Pleats of skin inside of a bend: they begin at this curvature, in units of 1 / half width, and are this deep for each
# unit beyond it, in half widths; one follows the other after this many scales.
_PLEAT_FROM, _PLEAT_DEPTH, _PLEAT_SCALES = 0.15, 0.35, 1.5
# The rounded end of the tail has this share of the largest half width.
_TAIL_TIP = 0.08
# Half of the angle around the body's axis that the rows of scales cover. The belly's plates cover the rest.
SIDE_ANGLE = 0.74 * np.pi


class Sizes(NamedTuple):
    """Half width, half heights of back and belly, and height of the axis above the resting line; m, each (n,)."""

    width: np.ndarray
    back: np.ndarray
    belly: np.ndarray
    axis: np.ndarray


class Body(NamedTuple):
    """The smooth body of a species along a spine; `radius` is its largest half width in metres."""

    spine: Spine
    species: Species
    radius: float

    @property
    def head_end(self) -> float:
        """The arc length in metres at which the scales begin."""
        return self.species.head_length * self.radius

    def sizes(self, s: np.ndarray) -> Sizes:
        """The half sizes at arc lengths s (n,) in metres: of the head, and behind its end of the body."""
        kind, length = self.species, self.spine.length
        swelling = smoothstep((s - self.head_end) / (0.3 * length))
        trunk = kind.neck + (1 - kind.neck) * swelling
        trunk = trunk * (1 + _GIRTH * np.sin(2 * np.pi * np.outer((3.3, 7.7), s / length)).sum(axis=0))
        trunk = trunk * (1 - (1 - _TAIL_TIP) * (1 - np.clip((length - s) / (0.5 * length), 0, 1)) ** 2.0)
        tip = _rounded((length - s) / (3 * _TAIL_TIP * self.radius))
        h = np.clip(s / self.head_end, 0, 1)
        # Control values from the snout to the first scales.
        jaw, neck = kind.jaw, kind.neck
        width = np.array((0.52, 0.60, 0.70, 0.82, 0.95, 1.02, 1.00, 0.92, 0.90)) * jaw
        width[-2:] = neck
        back = np.array((0.50, 0.62, 0.80, 0.98, 1.04, 1.06, 1.04, 1.0, 1.0)) * kind.head_height
        belly = np.array((0.42, 0.52, 0.62, 0.68, 0.74, 0.78, 0.80, 0.80, 0.80)) * kind.head_height
        back[-2:], belly[-2:] = _BACK * neck, _BELLY * neck
        head = bspline(np.stack([width, back, belly], axis=1), h.ravel()).reshape(*h.shape, 3)
        snout = _rounded(s / (0.22 * self.head_end))
        # The head's sizes blend into the trunk's over its last sixth.
        share = smoothstep((h - 5 / 6) * 6)
        profiles = [head[..., k] * (1 - share) + part * trunk * share for k, part in enumerate((1.0, _BACK, _BELLY))]
        sizes = [profile * snout * tip for profile in profiles]
        return Sizes(*(self.radius * size for size in (*sizes, profiles[2])))

    def points(self, s: np.ndarray, angle: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """Points (n, 3) of the skin in metres, at arc lengths s, at angles around the body (0 on the back's midline,
        increasing to the side of the spine), and `rise` metres above the smooth body; all (n,)."""
        width, back, belly, axis = self.sizes(s)
        sine, cosine = np.sin(angle), np.cos(angle)
        out = _section(sine, cosine)
        across = (width + rise) * out * sine
        up = axis + (np.where(cosine < 0, belly, back) + rise) * out * cosine
        spine = self.spine
        axes = [np.stack([np.interp(s, spine.s, part[:, k]) for k in range(3)], axis=1) for part in spine[1:]]
        return axes[0] + across[:, None] * axes[2] + up[:, None] * axes[3]

    def pleats(self, s: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """The depth (n,) in metres of the skin's pleats inside of bends, at arc lengths s and angles as for points."""
        spine = self.spine
        bend = (np.gradient(spine.tail, spine.s, axis=0) * spine.side).sum(axis=1) * self.radius
        inside = np.clip(np.interp(s, spine.s, bend) * np.sin(angle) - _PLEAT_FROM, 0, None)
        count = np.interp(s, spine.s, self.scale_counts(spine.s)) / _PLEAT_SCALES + 0.2 * np.sin(5 * angle)
        return self.radius * _PLEAT_DEPTH * inside * (0.5 - 0.5 * np.cos(2 * np.pi * count))

    def scale_counts(self, s: np.ndarray) -> np.ndarray:
        """The number of scales of a row up to each of the arc lengths s (n,), counted from the first of them."""
        width = np.maximum(self.sizes(s).width, 0.3 * self.radius)
        steps = np.diff(s) / (0.5 * (width[1:] + width[:-1]) * self.species.scale_length)
        return np.concatenate([[0], np.cumsum(steps)])

    def scale_lengths(self, s: np.ndarray) -> np.ndarray:
        """The distance from one scale to the next of its row, in metres, at arc lengths s (n,)."""
        return self.species.scale_length * np.maximum(self.sizes(s).width, 0.3 * self.radius)


def around(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The way around a body from the back's midline to each angle (n,), in half widths, and the angle by which its
    normal has turned there, in radians. Both are negative for negative angles."""
    fine = np.linspace(0, np.pi, 2001)
    sine, cosine = np.sin(fine), np.cos(fine)
    out = _section(sine, cosine)
    steps = np.diff(np.stack([out * sine, out * cosine * np.where(cosine < 0, _BELLY, _BACK)], axis=1), axis=0)
    way = np.concatenate([[0], np.cumsum(np.hypot(*steps.T))])
    turn = np.arctan2(-steps[:, 1], steps[:, 0])
    middle = (fine[1:] + fine[:-1]) / 2
    size = np.abs(angle)
    return np.sign(angle) * np.interp(size, fine, way), np.sign(angle) * np.interp(size, middle, turn)


def _section(sine: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    """The distance from the axis, in half sizes, of a section's outline."""
    return (np.abs(sine) ** _SECTION + np.abs(cosine) ** _SECTION) ** (-1 / _SECTION)


def body_along(spine: Spine, species: Species) -> Body:
    """The body of a species along a spine."""
    return Body(spine, species, spine.length / species.slenderness)


def _rounded(x: np.ndarray) -> np.ndarray:
    """A quarter ellipse from 0 at x = 0 to 1 at x >= 1."""
    return np.sqrt(1 - (1 - np.clip(x, 0, 1)) ** 2)
