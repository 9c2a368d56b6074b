# SPDX-License-Identifier: GPL-3.0-or-later
"""The smooth body of a snake species along the line under its belly, which a pose or any polygon gives."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...precompute.base.failure import GratingError

# Samples along a spine: a step is a 25th of the body's radius, so that bends look smooth.
_STATIONS = 2001
# The largest number of control points after resampling; more would pass the polygon's corners on to the body.
_CONTROLS = 96


class Spine(NamedTuple):
    """The line under the belly, at n arc lengths s from the snout in metres: points (n, 3) in metres, and unit vectors
    (n, 3) towards the tail, to the side and to the back. (tail, side, back) is right-handed."""

    s: np.ndarray
    points: np.ndarray
    tail: np.ndarray
    side: np.ndarray
    back: np.ndarray

    @property
    def length(self) -> float:
        """The length from snout to tail, in metres."""
        return float(self.s[-1])


def bspline(points: np.ndarray, t: np.ndarray) -> np.ndarray:
    """The uniform cubic B-spline of control points (n, d), from the first to the last of them, at t (m,) in [0, 1]."""
    padded = np.vstack([2 * points[0] - points[1], points, 2 * points[-1] - points[-2]])
    x = t * (len(points) - 1)
    span = np.minimum(x.astype(int), len(points) - 2)
    x = (x - span)[:, None]
    weights = ((1 - x) ** 3, 3 * x**3 - 6 * x**2 + 4, -3 * x**3 + 3 * x**2 + 3 * x + 1, x**3)
    return sum(w * padded[span + k] for k, w in enumerate(weights)) / 6


def spine_along(polygon: np.ndarray, length: float | None = None) -> Spine:
    """The spine along a polygon (n, 3) from snout to tail, scaled to a length in metres if given. Raises GratingError
    for fewer than two different points."""
    polygon = np.asarray(polygon, float)
    kept = np.ones(len(polygon), bool)
    kept[1:] = np.linalg.norm(np.diff(polygon, axis=0), axis=1) > 0
    polygon = polygon[kept]
    if len(polygon) < 2:
        raise GratingError("snake", "its line has no length", "give a curve of two or more different points")
    polygon = _resampled(polygon, max(4, min(_CONTROLS, len(polygon))))
    fine = bspline(polygon, np.linspace(0, 1, 10 * _STATIONS))
    arc = _arc_lengths(fine)
    s = np.linspace(0, arc[-1], _STATIONS)
    points = np.stack([np.interp(s, arc, fine[:, k]) for k in range(3)], axis=1)
    if length is not None:
        s, points = s * (length / arc[-1]), points * (length / arc[-1])
    tail = unit(np.gradient(points, s, axis=0))
    side = _sides(tail)
    return Spine(s, points, tail, side, np.cross(tail, side))


def _resampled(polygon: np.ndarray, count: int) -> np.ndarray:
    """The polygon resampled to `count` points at equal arc lengths, unless it has that many."""
    if len(polygon) == count:
        return polygon
    arc = _arc_lengths(polygon)
    at = np.linspace(0, arc[-1], count)
    return np.stack([np.interp(at, arc, polygon[:, k]) for k in range(3)], axis=1)


def _arc_lengths(points: np.ndarray) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _sides(tail: np.ndarray) -> np.ndarray:
    """Sideways unit vectors (n, 3) of a body whose belly points down wherever it lies.

    Starting at the tail, each vector is the previous one moved without twist, then pulled towards the horizontal; the
    pull weakens as the body gets steeper. So the belly stays in front where a neck rises and leans back."""
    level = np.stack([-tail[:, 1], tail[:, 0], np.zeros(len(tail))], axis=1)
    sides = np.empty_like(tail)
    side = level[-1] if level[-1].any() else np.array((0.0, 1.0, 0.0))
    for k in range(len(tail) - 1, -1, -1):
        flat = level[k] @ level[k]
        side = side + 0.2 * flat * np.copysign(1.0, level[k] @ side) * level[k]
        side = side - (side @ tail[k]) * tail[k]
        side = sides[k] = side / np.sqrt(side @ side)
    return sides


def smoothstep(x: np.ndarray) -> np.ndarray:
    """A smooth step: 0 up to 0, and 1 from 1 on."""
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


# Control polygons of the line under the belly, from snout to tail. The unit is about the radius of a body that is 80
# radii long; the floor is z = 0.
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


class Species(NamedTuple):
    """A snake species. Lengths are in largest half widths of the body, heights of a scale in scale lengths.

    slenderness    length of the animal
    rows           rows of scales over back and sides: 3 more than a multiple of 4, so that the last rows on both sides
                   begin and end with the belly's plates
    scale_length   from one scale to the next of its row
    head_length    from the snout to the first scales of the body
    jaw, neck      half widths
    head_height    half height of the head
    dome, keel     height of a scale's middle above its rim, and of the ridge along it
    lift           height of a scale's tail edge above its head edge; it ends half of this above the next scale
    turn_deg       largest random tilt of a scale, along and across a straight body each"""

    slenderness: float
    rows: int
    scale_length: float
    head_length: float
    jaw: float
    neck: float
    head_height: float
    dome: float
    keel: float
    lift: float
    turn_deg: float


SPECIES = {
    # 15 rows over a stout, glassy body; a flat, wedge-shaped head hardly wider than the neck.
    "XENOPELTIS": Species(80, 15, 0.50, 2.9, 0.80, 0.80, 0.50, 0.0, 0.0, 0.03, 0.5),
    # 23 rows, keeled on the back; a head distinct from a thin neck.
    "ELAPHE": Species(92, 23, 0.40, 3.2, 0.82, 0.60, 0.52, 0.0, 0.03, 0.06, 1.8),
}


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

    def bends(self, s: np.ndarray) -> np.ndarray:
        """The spine's curvature to its side (n,) at arc lengths s, in 1 / half width."""
        spine = self.spine
        bend = (np.gradient(spine.tail, spine.s, axis=0) * spine.side).sum(axis=1) * self.radius
        return np.interp(s, spine.s, bend)

    def pleats(self, s: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """The depth (n,) in metres of the skin's pleats inside of bends, at arc lengths s and angles as for points."""
        spine = self.spine
        inside = np.clip(self.bends(s) * np.sin(angle) - _PLEAT_FROM, 0, None)
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
