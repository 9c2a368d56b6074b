# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits a few round sources to the compact bright parts of a world. A source takes all light in its cone."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .panorama import Cells, panorama_cells
from .parts import Part, compact_parts

# The least share of the world's light that gets a source. Other light is spread over a surface's directions instead of
# forming a spectrum. 1 % of a white surface's light changes its lightness by at most 0.4 (116/3 * 0.01, from L* = 116
# Y^(1/3) - 16).
LEAST_SHARE = 0.01
# A part with an even smaller share is noise of the picture.
_GRAIN_SHARE = 0.0005
# The radius in radians of the widest cone.
WIDEST = 0.16
# A part may be wider, and is then divided. It is dropped if the number of sources is too small for that.
_WIDEST_PART = 0.6
# Narrower parts are searched for first. So a sun and the glow or cloud behind it become two sources.
_NARROW = 0.04
# A source with a wider cone and at least this share of the light is divided if `count` allows. A box of 10 degrees is
# not.
_UNDIVIDED, _DIVIDED_SHARE = 0.12, 4 * LEAST_SHARE
# The growth of the variance of each source that results from a division.
_SOFTENED = 0.4
# A cone ends where 1 - cos(angle) is three variances, and its surroundings are read from there to nine. A uniform disc
# of radius r has a variance of r^2/4 and a cone of radius 1.22 r; a square's cone ends at its corners.
_CONE, _SURROUNDINGS = 3.0, 9.0
# A disc's cone settles at once; the cone of a Gaussian or a glow settles to a thousandth within about 30 steps.
_STEPS, _SETTLED = 100, 1e-3


@dataclass(frozen=True)
class Source:
    """A compact bright part of the world, with a cone around it whose light belongs to the source.

    direction   (3,) unit vector towards the light, in Blender's world axes
    irradiance  (3,) W/m2 on a surface that faces it, linear RGB of the scene's working space: the integral of the
                radiance over the cone
    variance    of the bright part, rad^2 along one axis. The cone is where 1 - cos(angle) < 3 x variance"""

    direction: np.ndarray
    irradiance: np.ndarray
    variance: float

    @property
    def cone_radius(self) -> float:
        """The angle in radians between the axis of the cone and its edge."""
        return float(np.arccos(max(1 - _CONE * self.variance, -1)))


def fit_sources(radiance: np.ndarray, count: int) -> list[Source]:
    """Fit at most `count` sources to a world, the brightest first.

    radiance (rows, cols, 3) is a panorama, laid out as in panorama.py. Negative and non-finite pixels count as black. A
    part brighter than its surroundings becomes a source if it holds LEAST_SHARE of the world's light. The widest
    sources are divided while there are fewer than `count`; no cone is wider than WIDEST."""
    cells, flat = panorama_cells(*radiance.shape[:2]), clean(radiance)
    luminance = flat.mean(axis=1)
    total = float(luminance @ cells.solid_angles)
    pieces = []
    for parts, seen in _parts(luminance, radiance.shape[:2], LEAST_SHARE):
        owner = np.full(len(seen), -1)
        for index, part in enumerate(parts):
            owner[part.pixels] = index
        for index, part in enumerate(parts):
            free = np.flatnonzero((owner == index) | (owner < 0))
            pieces += _pieces(part, seen, cells, free=free, least=LEAST_SHARE * total)
    return lit(_divided(pieces, count, _DIVIDED_SHARE * total), flat, cells)


def refit(source: Source, radiance: np.ndarray, cells: Cells) -> Source:
    """Fit a source again: direction and variance from finer cells around it and their radiance (..., 3), and the
    irradiance from these cells' light in its cone."""
    flat = clean(radiance)
    piece = _settled(source, flat.mean(axis=1), cells)
    return lit([piece.source], flat, cells)[0]


def lit(sources: Sequence[Source], radiance: np.ndarray, cells: Cells) -> list[Source]:
    """Give each source the light (n, 3) of the cells in its cone as its irradiance. Returns the brightest first."""
    owner = owners(sources, cells.directions)
    light = clean(radiance) * cells.solid_angles[:, None]
    own = [replace(source, irradiance=light[owner == index].sum(axis=0)) for index, source in enumerate(sources)]
    return sorted(own, key=lambda source: -source.irradiance.sum())


def owners(sources: Sequence[Source], directions: np.ndarray) -> np.ndarray:
    """For each direction (n, 3) the index of the source that takes its light, or -1 if no cone contains it. Where cones
    overlap, the source with the least squared angle times variance takes it, such as a sun before a cloud."""
    nearest, owner = np.full(len(directions), np.inf), np.full(len(directions), -1)
    for index, source in enumerate(sources):
        away = 1 - directions @ source.direction
        taken = (away < _CONE * source.variance) & (away * source.variance < nearest)
        nearest[taken], owner[taken] = (away * source.variance)[taken], index
    return owner


def missed(radiance: np.ndarray, sources: Sequence[Source]) -> float:
    """The share, from 0 to 1, of the world's light that is bright and compact but in no source.

    It sums the excess, outside all cones, of the parts that fit_sources finds, and of fainter parts down to
    _GRAIN_SHARE. A pixel that a cone touches counts as inside, because a sun may be smaller than a pixel."""
    rows, cols = radiance.shape[:2]
    cells, luminance = panorama_cells(rows, cols), clean(radiance).mean(axis=1)
    light = float(luminance @ cells.solid_angles)
    reach = np.hypot(np.pi / rows, 2 * np.pi / cols) / 2
    outside = np.ones(len(luminance), bool)
    for source in sources:
        outside &= cells.directions @ source.direction < np.cos(min(source.cone_radius + reach, np.pi))
    lost = 0.0
    for parts, seen in _parts(luminance, (rows, cols), _GRAIN_SHARE):
        for part in parts:
            pixels = part.pixels[outside[part.pixels]]
            lost += float((seen[pixels] - part.base) @ cells.solid_angles[pixels])
    return lost / light if light else 0.0


def light_of_rest(radiance: np.ndarray, sources: Sequence[Source]) -> np.ndarray:
    """The light (3,) of a panorama (rows, cols, 3) that belongs to no source: its radiance summed over the solid
    angle."""
    cells = panorama_cells(*radiance.shape[:2])
    outside = owners(sources, cells.directions) < 0
    return cells.solid_angles[outside] @ clean(radiance)[outside]


@dataclass(frozen=True)
class _Piece:
    """A source and the light that gave its direction and variance: above the surroundings, in each of some cells."""

    source: Source
    light: np.ndarray
    cells: Cells

    @property
    def power(self) -> float:
        return float(self.light @ self.cells.solid_angles)


def _parts(luminance: np.ndarray, shape: tuple[int, int], share: float) -> Iterator[tuple[list[Part], np.ndarray]]:
    """Yield the narrow parts with at least this share of the light and the luminance (n,) that contains them, then the
    wide parts and the luminance without the narrow ones."""
    cells = panorama_cells(*shape)
    total = float(luminance @ cells.solid_angles)
    if total == 0:
        return
    seen = luminance
    for radius in (_NARROW, _WIDEST_PART):
        widest = (1 - np.cos(radius)) / _CONE
        parts = compact_parts(seen.reshape(shape), cells, least=share * total, widest=widest)
        yield parts, seen
        seen = _without(parts, seen, cells)


def _without(parts: list[Part], luminance: np.ndarray, cells: Cells) -> np.ndarray:
    """The luminance (n,) with each narrow part, and the soft edge around it, clipped to its surroundings."""
    seen = luminance.copy()
    for part in parts:
        middle = cells.moments[part.pixels].sum(axis=0)
        cosine = cells.directions @ (middle / np.linalg.norm(middle))
        near = cosine > np.cos(1.5 * _NARROW)
        near[part.pixels] = True
        around = seen[~near & (cosine > np.cos(2.25 * _NARROW))]
        seen[near] = np.minimum(seen[near], np.median(around) if len(around) else part.base)
    return seen


def _pieces(part: Part, luminance: np.ndarray, cells: Cells, *, free: np.ndarray, least: float) -> list[_Piece]:
    """Split a part into pieces: the densest one, and others outside it with at least this light.

    Two windows with a bright wall between them may be one part. A ring around a piece is no piece, nor is the edge of a
    sun that straddles pixels."""
    pieces: list[_Piece] = []
    left = part.pixels
    while True:
        light = np.maximum(luminance[left] - part.base, 0)
        if light @ cells.solid_angles[left] < least:
            break
        begin = _moments(light, cells[left])
        piece = _settled(begin, luminance[free], cells[free])
        is_ring = owners([each.source for each in pieces], piece.source.direction[None])[0] >= 0
        if pieces and (is_ring or piece.source.cone_radius > WIDEST):
            break
        pieces.append(piece)
        if begin.cone_radius < _NARROW:
            break
        left = left[owners([piece.source], cells.directions[left]) < 0]
        free = free[owners([piece.source], cells.directions[free]) < 0]
    return pieces


def _settled(source: Source, luminance: np.ndarray, cells: Cells) -> _Piece:
    """Iterate a source until its cone contains the light that gives it its variance.

    The light in a cone, above the median of the cone's surroundings, has a variance, which gives the next cone. A cone
    that is too wide narrows down to the dense part: a sun in its glow becomes the sun."""
    for _ in range(_STEPS):
        away = 1 - cells.directions @ source.direction
        inside = np.flatnonzero(away < _CONE * source.variance)
        around = luminance[(away >= _CONE * source.variance) & (away < _SURROUNDINGS * source.variance)]
        light = np.maximum(luminance[inside] - (np.median(around) if len(around) else 0), 0)
        piece = _Piece(source, light, cells[inside])
        if not light.any():
            break
        variance, source = source.variance, _moments(light, piece.cells)
        if abs(source.variance - variance) < _SETTLED * variance:
            break
    return piece


def _moments(light: np.ndarray, cells: Cells) -> Source:
    """Light above the surroundings, in cells, as a source without irradiance.

    The mean of 1 - cos(angle) is the variance along one axis, half of the sum along both."""
    moment, power = light @ cells.moments, light @ cells.solid_angles
    length = np.linalg.norm(moment)
    return Source(moment / length, np.zeros(3), float(1 - length / power))


def _divided(pieces: list[_Piece], count: int, least: float) -> list[Source]:
    """The sources of the pieces, at most `count`.

    A piece that is wider than a source may be is divided until no part is too wide. Pieces with the most light per
    source come first. A piece is dropped if it needs more sources than are left. Spare sources then halve those with
    the most light far from their axes, if they are wide and have at least `least` light."""
    families: list[list[_Piece]] = []
    for family in sorted(map(_narrow, pieces), key=lambda family: -sum(p.power for p in family) / len(family)):
        if sum(map(len, families)) + len(family) <= count:
            families.append(family)
    while sum(map(len, families)) < count:
        wide = [
            (family, piece)
            for family in families
            for piece in family
            if piece.source.cone_radius > _UNDIVIDED and piece.power >= least and np.count_nonzero(piece.light) > 1
        ]
        if not wide:
            break
        family, widest = max(wide, key=lambda each: each[1].power * each[1].source.variance)
        family[:] = [piece for piece in family if piece is not widest] + _halves(widest)
    return [source for family in families for source in _softened(family)]


def _narrow(piece: _Piece) -> list[_Piece]:
    """Halve a piece until no part is wider than a source may be."""
    if piece.source.cone_radius <= WIDEST or np.count_nonzero(piece.light) <= 1:
        return [piece]
    return [part for half in _halves(piece) for part in _narrow(half)]


def _softened(family: list[_Piece]) -> list[Source]:
    """The sources of a divided piece, made wider and moved together, which keeps the piece's variance.

    A surface shows each source as a Gaussian. Squares side by side have a deviation of 0.29 of their distance.
    Gaussians of this width show as separate streaks: their sum varies by 39 %, 2 exp(-2 (pi 0.29)^2). With _SOFTENED,
    the deviation of four squares is 0.37 of their distance and of two squares 0.40, so it varies by 14 and 8 %. Wider
    Gaussians would blur the edges of the whole. At most half of the variance between the sources becomes their own,
    because the halves of a disc overlap already."""
    if len(family) == 1:
        return [family[0].source]
    weights = np.array([piece.power for piece in family])
    weights /= weights.sum()
    own = np.array([piece.source.variance for piece in family])
    towards = np.array([piece.source.direction for piece in family])
    middle = weights @ towards
    middle /= np.linalg.norm(middle)
    between = 1 - weights @ towards @ middle
    growth = min(_SOFTENED, between / (weights @ own) / 2)
    nearer = middle + np.sqrt(1 - growth * (weights @ own) / between) * (towards - middle)
    nearer /= np.linalg.norm(nearer, axis=1)[:, None]
    return [
        replace(piece.source, direction=axis, variance=variance)
        for piece, axis, variance in zip(family, nearer, own * (1 + growth), strict=True)
    ]


def _halves(piece: _Piece) -> list[_Piece]:
    """Halve a piece by the plane through its centre, perpendicular to its longest direction."""
    weights = piece.light * piece.cells.solid_angles
    off = piece.cells.directions - np.average(piece.cells.directions, axis=0, weights=weights)
    _, axes = np.linalg.eigh((weights * off.T) @ off)
    side = off @ axes[:, -1] > 0
    return [_Piece(_moments(piece.light[s], piece.cells[s]), piece.light[s], piece.cells[s]) for s in (side, ~side)]


def clean(radiance: np.ndarray) -> np.ndarray:
    """Radiance (..., 3) as (n, 3), black where it is negative or not finite."""
    flat = np.asarray(radiance, float).reshape(-1, 3)
    return np.where(np.isfinite(flat) & (flat > 0), flat, 0.0)
