# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds from where a lamp makes a grating show the most colour to a viewer.

Candidates are the directions of an even lattice over the sphere. Each is scored by the mean colour (colour_of) that
the patches which the viewer sees would show under a lamp there. The best candidate is then refined within its cell.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

# The number of candidates over the whole sphere: about 5 degrees apart. A visible first order of a grating of 1.6 um is
# about 10 degrees wide.
CANDIDATES = 1500
# The area of a candidate's cell, as the variance along one axis of a disc of that area, rad2. The lamp counts as no
# smaller in the first round, so that an order between two candidates is not missed.
CELL_VARIANCE = 1 / CANDIDATES
# The radius in radians of the neighbourhood that the refinement searches, and its number of directions.
_CELL_RADIUS, _REFINED = 1.5 * math.sqrt(4 / CANDIDATES), 60
# Lamps this close to the horizon, or below it, are used only if no other shows colour.
_LOWEST_ELEVATION = math.radians(5)
# The least angle in azimuth between the best and the second direction, and the least angle between the two, in radians.
AZIMUTH_APART, _APART = math.radians(40), math.radians(25)
# The radiance of the picture's middle grey, and the colour that a place burnt to white takes away.
_MIDDLE, _GLARE = 0.5, 0.3
# The least score of a second direction, over that of the best.
_WORTHWHILE = 0.1
# The colour (colour_of) from which on a patch of a light hue counts as coloured.
_CLEAR = 0.1
# The luminance of linear Rec.709, and the weight of a hue without any, where white has 1.
_LUMINANCE, _DARK_HUE = np.array((0.2126, 0.7152, 0.0722)), 0.15
# Candidates times places that are scored at once, so that arrays stay below 10 MB.
_AT_ONCE = 1 << 16
# Radiance in linear RGB (n, 3) towards wr (n, 3) under lamps at wi (n, 3), unit vectors along (T, B, N), of irradiance
# (n,) on a surface that faces the lamp, and of variance (n,), rad2.
Radiance = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Seen:
    """n places of one surface that a viewer sees, relative to the middle of what is lit.

    points    (n, 3), positions
    to_view   (n, 3), unit vectors to the viewer
    frames    (n, 3, 3), the unit vectors T, B, N of each place
    patches   (n,), ascending numbers: the viewer sees places of one number as one spot, the mean of their light
    radiance  what the surface shows under a lamp
    under     the albedo of the diffuse surface under the relief, whose light washes the colours out"""

    points: np.ndarray
    to_view: np.ndarray
    frames: np.ndarray
    patches: np.ndarray
    radiance: Radiance
    under: float = 0.0

    @property
    def first_of_patch(self) -> np.ndarray:
        """The index of the first place of each patch."""
        return np.flatnonzero(np.diff(self.patches, prepend=-np.inf))


@dataclass(frozen=True)
class Lamp:
    """A lamp that shines at the middle from any direction.

    irradiance  at the middle, of a surface that faces the lamp
    variance    of its disc along one axis, seen from the middle, rad2
    distance    from the middle; infinite for a sun"""

    irradiance: float
    variance: float = 0.0
    distance: float = math.inf


# The preference (m,) among unit vectors (m, 3) to the lamp: factors from 0 to 1.
Preference = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Chosen:
    """A direction for a lamp: a unit vector (3,), and the mean colour that the viewer then sees."""

    direction: np.ndarray
    colour: float


def two_best(seen: Sequence[Seen], lamp: Lamp, prefer: Preference) -> tuple[Chosen, Chosen] | None:
    """The direction from which a lamp makes the viewer see the most colour, and the best of another azimuth.

    The second direction counts twice what it adds at patches that the first leaves without colour. Where no second one
    shows a tenth of the colour, it is the first, turned by half a turn about the vertical, with its colour of 0. None
    if no direction shows colour."""
    coarse = _as_wide_as_a_cell(lamp)
    for candidates in _candidates():
        colours, weights = colours_at(seen, candidates, coarse), prefer(candidates)
        score = colours.mean(axis=1) * weights
        if score.max() <= 0:
            continue
        best = int(np.argmax(score))
        added = np.maximum(colours - colours[best], 0).mean(axis=1)
        others = (score + added * weights) * are_apart(candidates, candidates[best])
        first = _refined(seen, lamp, prefer, around=candidates[best])
        second = int(np.argmax(others))
        if others[second] < _WORTHWHILE * score[best]:
            return first, Chosen(first.direction * (-1, -1, 1), 0.0)
        return first, _refined(seen, lamp, prefer, around=candidates[second])
    return None


def covering(
    seen: Sequence[Seen], lamp: Lamp, prefer: Preference, *, most: int, factors: Sequence[float]
) -> list[tuple[Chosen, float]]:
    """Up to `most` directions whose lamps together make the viewer see colour at the most patches, each with the one of
    the factors on the lamp's irradiance that serves this best. Empty if no direction shows colour.

    A patch counts by its share of a clear colour, so a further band counts more than a brighter one, and a patch that
    is burnt to white counts against the lamp. Each lamp is the best addition to those before it. None is chosen that
    adds less than a tenth of what the first adds."""
    candidates, _ = _candidates()
    light, weights = light_at(seen, candidates, _as_wide_as_a_cell(lamp)), prefer(candidates)
    sum_of, gain = np.zeros(light.shape[1:]), 0.0
    found: list[tuple[Chosen, float]] = []
    while len(found) < most:
        before = _covered(sum_of)
        gains = np.stack([_covered(sum_of + factor * light) - before for factor in factors]) * weights
        level, best = divmod(int(np.argmax(gains)), len(candidates))
        if gains[level, best] <= _WORTHWHILE * gain:
            break
        gain = gain or float(gains[level, best])
        added = factors[level] * light[best]
        sum_of = sum_of + added
        found.append((Chosen(candidates[best], float(colour_of(added).mean())), factors[level]))
    return found


def _candidates() -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, 3) that are even over the sphere: those above the lowest elevation of a lamp, and the others."""
    everywhere = fibonacci_sphere(CANDIDATES)
    high = everywhere[:, 2] > math.sin(_LOWEST_ELEVATION)
    return everywhere[high], everywhere[~high]


def _as_wide_as_a_cell(lamp: Lamp) -> Lamp:
    """The lamp, at least as wide as the distance of candidates, so that none of its light falls between them."""
    return replace(lamp, variance=max(lamp.variance, CELL_VARIANCE))


def _covered(rgb: np.ndarray) -> np.ndarray:
    """The share of patches that show a clear colour, of linear RGB (..., n, 3). A dark hue counts less: the eye sees a
    green or a gold better than a violet of the same components."""
    shown = 1 - np.exp(-rgb / _MIDDLE)
    lightness = shown @ _LUMINANCE / np.maximum(shown.max(axis=-1), 1e-30)
    return np.minimum(colour_of(rgb) / _CLEAR * (_DARK_HUE + (1 - _DARK_HUE) * lightness), 1).mean(axis=-1)


def colours_at(seen: Sequence[Seen], directions: np.ndarray, lamp: Lamp) -> np.ndarray:
    """The colour (m, n) that each of all n patches shows under a lamp in each of m directions."""
    return colour_of(light_at(seen, directions, lamp))


def light_at(seen: Sequence[Seen], directions: np.ndarray, lamp: Lamp) -> np.ndarray:
    """The linear RGB (m, n, 3) that each of all n patches shows under a lamp in each of m directions."""
    rows = max(1, _AT_ONCE // max(sum(len(each.points) for each in seen), 1))
    parts = [directions[start : start + rows] for start in range(0, len(directions), rows)]
    return np.concatenate([np.concatenate([_light(each, part, lamp) for each in seen], axis=1) for part in parts])


def are_apart(directions: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Whether directions (m, 3) differ enough from another one (3,) for a second lamp, (m,)."""
    azimuths = np.arctan2(directions[:, 1], directions[:, 0]) - math.atan2(first[1], first[0])
    turned = np.abs((azimuths + np.pi) % (2 * np.pi) - np.pi)
    return (turned >= AZIMUTH_APART) & (directions @ first <= math.cos(_APART))


def fibonacci_sphere(count: int) -> np.ndarray:
    """Unit vectors (count, 3), evenly spread over the sphere."""
    return _spiral(1 - (2 * np.arange(count) + 1) / count)


def _light(seen: Seen, directions: np.ndarray, lamp: Lamp) -> np.ndarray:
    """The linear RGB (m, n, 3) of one surface's patches."""
    if math.isinf(lamp.distance):
        wi = np.einsum("nij,mj->mni", seen.frames, directions)
        nearness = np.ones(wi.shape[:2])
    else:
        to_lamp = lamp.distance * directions[:, None] - seen.points
        squared = np.maximum((to_lamp**2).sum(axis=2), 1e-12 * lamp.distance**2)
        wi = np.einsum("nij,mnj->mni", seen.frames, to_lamp / np.sqrt(squared)[..., None])
        nearness = lamp.distance**2 / squared
    wr = np.broadcast_to(np.einsum("nij,nj->ni", seen.frames, seen.to_view), wi.shape)
    rgb = np.zeros(wi.shape)
    lit = (wi[..., 2] > 0) & (wr[..., 2] > 0)
    if lit.any():
        near = nearness[lit]
        rgb[lit] = seen.radiance(wi[lit], wr[lit], lamp.irradiance * near, lamp.variance * near)
        rgb[lit] += (seen.under / math.pi * lamp.irradiance * near * wi[lit][:, 2])[:, None]
    first = seen.first_of_patch
    places = np.diff(first, append=len(seen.points))
    return np.add.reduceat(rgb, first, axis=1) / places[:, None]


def colour_of(rgb: np.ndarray) -> np.ndarray:
    """How coloured linear RGB (..., 3) looks in a picture, (...,), at most 1: the largest minus the smallest component,
    times the saturation, which is this difference over the largest. A roll-off comes first, so that bright colours fade
    to white as on film. Negative where all components are burnt out, above 1."""
    shown = 1 - np.exp(-rgb / _MIDDLE)
    largest = shown.max(axis=-1)
    colour = (largest - shown.min(axis=-1)) ** 2 / np.maximum(largest, 1e-30)
    return colour - _GLARE * (rgb.min(axis=-1) > 1)


def _refined(seen: Sequence[Seen], lamp: Lamp, prefer: Preference, *, around: np.ndarray) -> Chosen:
    """The best direction within the cell of a candidate, for the lamp as it is."""
    directions = np.concatenate([around[None], _cap(around, _CELL_RADIUS, _REFINED)])
    colour = colours_at(seen, directions, lamp).mean(axis=1)
    best = int(np.argmax(colour * prefer(directions)))
    return Chosen(directions[best], float(colour[best]))


def _cap(axis: np.ndarray, radius: float, count: int) -> np.ndarray:
    """Unit vectors (count, 3), evenly spread over the cap of a radius (radians) around an axis."""
    own = _spiral(1 - (1 - math.cos(radius)) * (np.arange(count) + 0.5) / count)
    x = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    x /= np.linalg.norm(x)
    return own @ np.stack([x, np.cross(axis, x), axis])


def _spiral(z: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) at heights z (n,), each turned by the golden angle from the one before."""
    turn = np.arange(len(z)) * math.pi * (3 - math.sqrt(5))
    across = np.sqrt(1 - z**2)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1)
