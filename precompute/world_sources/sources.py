# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits a few round sources to the compact bright parts of a world. A source takes all light in its cone.

Worlds are equirectangular pictures in Blender's convention. Row 0 is at the bottom, as in Blender's pixels. The
picture's centre looks along +X, its left half towards +Y, its top row towards +Z. Blender's Environment Texture reads
pictures this way. A panoramic camera of Cycles that looks along +X, with +Z up, renders them this way.

A compact bright part is brighter than its surroundings and not wide. Pixels are added from the brightest down. A
connected set of added pixels is a part that exceeds its surroundings, and its excess is the light above them. Sets
grow, meet and merge as in a component tree (Salembier, Oliveras and Garrido 1998, "Antiextensive connected operators
for image and sequence processing"), until they are wider than a source may be. Closer looks at the world fit sources
finer than a panorama's pixels."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np


@dataclass(frozen=True)
class Cells:
    """Pieces of the sphere, one per pixel of a picture, in pixel order: rows from the bottom.

    directions      (n, 3) unit vectors to the cells' centres
    solid_angles    (n,) steradians
    moments         (n, 3) the integral of the unit vector over each cell. The wider the cell, the shorter the moment is
                    than the solid angle, so a sum of moments includes the width of its cells"""

    directions: np.ndarray
    solid_angles: np.ndarray
    moments: np.ndarray

    def __getitem__(self, which: np.ndarray) -> Cells:
        """Some of the cells, by their indices or a mask."""
        return Cells(self.directions[which], self.solid_angles[which], self.moments[which])


def panorama_cells(rows: int, cols: int) -> Cells:
    """The cells of a picture of the whole sphere."""
    return _cells((rows, cols), np.pi / 2, np.pi)


def crop_cells(size: int, half_angle: float, direction: np.ndarray) -> Cells:
    """The cells of a square picture, `size` pixels wide, that looks along `direction` (3,).

    Latitude and longitude about the axes of crop_frame(direction) go from -half_angle to half_angle, in radians."""
    cells = _cells((size, size), half_angle, half_angle)
    frame = crop_frame(direction)
    return Cells(cells.directions @ frame.T, cells.solid_angles, cells.moments @ frame.T)


def crop_frame(direction: np.ndarray) -> np.ndarray:
    """The axes (3, 3) of a crop. The columns are world directions: to the crop's centre, to its left, and up."""
    forward = np.asarray(direction, float) / np.linalg.norm(direction)
    beside = np.cross((0.0, 0.0, 1.0) if abs(forward[2]) < 0.9 else (0.0, 1.0, 0.0), forward)
    left = beside / np.linalg.norm(beside)
    return np.stack((forward, left, np.cross(forward, left)), axis=1)


def inside_crop(directions: np.ndarray, half_angle: float, direction: np.ndarray) -> np.ndarray:
    """Which directions (n, 3) a crop shows, as a mask (n,)."""
    x, y, z = (directions @ crop_frame(direction)).T
    return (np.abs(np.arctan2(y, x)) < half_angle) & (np.abs(np.arcsin(np.clip(z, -1, 1))) < half_angle)


def _cells(shape: tuple[int, int], latitude: float, longitude: float) -> Cells:
    """The cells of a picture from -latitude to latitude, and from longitude at its left to -longitude.

    The integrals over a cell are written as products, which stay exact for tiny cells."""
    rows, cols = shape
    high, wide = 2 * latitude / rows, 2 * longitude / cols
    theta = ((np.arange(rows) + 0.5) * high - latitude)[:, None]
    phi = (longitude - (np.arange(cols) + 0.5) * wide)[None, :]
    directions = np.stack(np.broadcast_arrays(np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), np.sin(theta)))
    solid_angles = np.broadcast_to(2 * np.cos(theta) * np.sin(high / 2) * wide, shape)
    across = high / 2 + np.cos(2 * theta) * np.sin(high) / 2  # the integral of cos^2 over the latitude
    chord = 2 * np.sin(wide / 2)
    upwards = np.sin(2 * theta) * np.sin(high) / 2 * wide
    moments = np.stack(np.broadcast_arrays(across * chord * np.cos(phi), across * chord * np.sin(phi), upwards))
    return Cells(directions.reshape(3, -1).T, solid_angles.reshape(-1), moments.reshape(3, -1).T)


# A bright part has at least this many times the radiance of its surroundings.
_CONTRAST = 2.0


@dataclass(frozen=True)
class Part:
    """A connected part of a picture.

    pixels      (n,) indices of its pixels
    base        the luminance of its surroundings
    excess      its light above the base, luminance x steradians"""

    pixels: np.ndarray
    base: float
    excess: float


@dataclass
class _Set:
    """A connected set of pixels, sums over the pixels, and the bright parts that met in the set."""

    area: float
    light: float
    light_squared: float
    moment: list[float]
    pixels: list[int]
    parts: list[Part] = field(default_factory=list)
    # False once the set grew too wide to be a part.
    is_open: bool = True

    def variance(self) -> float:
        x, y, z = self.moment
        return 1 - (x * x + y * y + z * z) ** 0.5 / self.area

    def take(self, other: _Set) -> None:
        self.area += other.area
        self.light += other.light
        self.light_squared += other.light_squared
        self.moment = [a + b for a, b in zip(self.moment, other.moment, strict=True)]
        self.pixels += other.pixels
        self.parts = self.parts + other.parts


class _Sets:
    """The connected sets of the pixels added so far, and the parts found in closed sets."""

    def __init__(self, least: float, widest: float) -> None:
        self._least, self._widest = least, widest
        self._parent: dict[int, int] = {}
        self._sets: dict[int, _Set] = {}
        self.found: list[Part] = []

    def add(self, pixel: int, alone: _Set, *, level: float, neighbours: Iterable[int]) -> None:
        """Add a pixel of luminance `level`, and join the sets that it touches."""
        self._parent[pixel], self._sets[pixel] = pixel, alone
        for neighbour in neighbours:
            if neighbour in self._parent:
                self._join(self._root(pixel), self._root(neighbour), level)
        grown = self._sets[self._root(pixel)]
        if grown.is_open and grown.variance() > self._widest:
            self._close(grown, level)

    def close_all(self, level: float) -> None:
        """Close all sets at the luminance `level` of the surroundings."""
        for grown in self._sets.values():
            self._close(grown, level)

    def _join(self, one: int, other: int, level: float) -> None:
        if one == other:
            return
        # The set with fewer pixels joins the other.
        into, gone = sorted((one, other), key=lambda root: -len(self._sets[root].pixels))
        large, small = self._sets[into], self._sets.pop(gone)
        self._parent[gone] = into
        if large.is_open and small.is_open:
            parts, others = (_resolved(grown, level, self._least) for grown in (large, small))
            large.take(small)
            if parts and others:
                large.parts = parts + others
        else:
            self._close(large, level)
            self._close(small, level)

    def _close(self, grown: _Set, level: float) -> None:
        if grown.is_open:
            self.found += _resolved(grown, level, self._least)
            grown.is_open, grown.pixels = False, []

    def _root(self, pixel: int) -> int:
        parent = self._parent
        while parent[pixel] != pixel:
            parent[pixel] = pixel = parent[parent[pixel]]
        return pixel


def compact_parts(luminance: np.ndarray, cells: Cells, *, least: float, widest: float) -> list[Part]:
    """Find the parts of a panorama's luminance (rows, cols), the greatest excess first. Each has an excess of at least
    `least` and, if it were evenly bright, a variance of at most `widest` (rad^2).

    Parts that meet within a larger bright set count separately if together they hold at least half of its excess.
    Otherwise the set is one part of uneven brightness."""
    values = luminance.reshape(-1)
    # An even disc of variance `widest` has 4 pi x `widest` steradians. Pixels so dark that they fill it with half of
    # `least` count as black.
    floor = least / (8 * np.pi * widest)
    order = np.argsort(-values, kind="stable")
    levels, areas, moments = values.tolist(), cells.solid_angles.tolist(), cells.moments.tolist()
    sets = _Sets(least, widest)
    for pixel in order[values[order] > floor].tolist():
        level, area = levels[pixel], areas[pixel]
        alone = _Set(area, level * area, level * level * area, moments[pixel], [pixel])
        sets.add(pixel, alone, level=level, neighbours=_neighbours(pixel, *luminance.shape))
    sets.close_all(floor)
    return sorted(sets.found, key=lambda part: -part.excess)


def _resolved(grown: _Set, level: float, least: float) -> list[Part]:
    """The parts of a set whose surroundings have this luminance: the set itself, the parts that met in it, or none."""
    excess = grown.light - level * grown.area
    if excess < least or sum(part.excess for part in grown.parts) >= excess / 2:
        return grown.parts
    # The part's mean luminance, weighted by its excess, must reach _CONTRAST times the level.
    if grown.light_squared - level * grown.light < _CONTRAST * level * excess:
        return grown.parts
    return [Part(np.array(grown.pixels), level, excess)]


def _neighbours(pixel: int, rows: int, cols: int) -> tuple[int, ...]:
    """The pixels beside, below and above. A panorama wraps around horizontally, and continues across the poles."""
    row, col = divmod(pixel, cols)
    across = (col + cols // 2) % cols
    below = (row - 1) * cols + col if row else across
    above = (row + 1) * cols + col if row < rows - 1 else row * cols + across
    return row * cols + (col + 1) % cols, row * cols + (col - 1) % cols, below, above


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

    radiance (rows, cols, 3) is a panorama, laid out as above. Negative and non-finite pixels count as black. A
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


# A closer look at the world: takes a direction (3,), an angle and a size, and returns the radiance (size, size, 3) of
# crop_cells(size, angle, direction).
Look = Callable[[np.ndarray, float, int], np.ndarray]
# Sources with a narrower cone, in radians, get closer looks. No piece of a divided source is this narrow.
_NARROW_ENOUGH = 0.058
# Looks repeat until the cone has this many pixels on each side, which fits its light to about 1 %.
_RESOLVED_PIXELS = 6
# The width of a look in pixels, and its half width in radii of the cone: the surroundings are read within 1.73 radii.
LOOK_SIZE, _LOOK_RADII = 64, 3
# Each look is about ten times finer than the one before: the third finds a disc of 0.001 degrees.
_LOOKS = 3


def fit_closely(radiance: np.ndarray, count: int, look: Look, *, suns: Sequence[np.ndarray] = ()) -> list[Source]:
    """Fit sources to a panorama (rows, cols, 3) like fit_sources, and fit each small source again in closer looks.

    `suns` are directions (3,) that always get a closer look, because the panorama may miss a small sun."""
    world = _World(radiance, look)
    found = fit_sources(radiance, count)
    narrow = [source for source in found if source.cone_radius < _NARROW_ENOUGH]
    hinted = [Source(np.array(sun, float), np.zeros(3), (np.pi / radiance.shape[0]) ** 2 / 12) for sun in suns]
    fitted = [world.seen_closely(sun) for sun in hinted if owners(narrow, sun.direction[None])[0] < 0]
    fitted = [sun for sun in fitted if sun.irradiance.sum() >= world.least()]
    if fitted:
        found = fit_sources(radiance, count - len(fitted))
    for source in found:
        source = world.seen_closely(source)
        if not any(_is_same(source, other) for other in fitted):
            fitted.append(source)
    lights = lit(fitted, world.radiance, world.cells)
    # A source that is left out may lie in the cone of another, which then takes its light.
    counted = [source for source in lights if source.irradiance.sum() >= world.least()][: max(count, 0)]
    return lit(counted, world.radiance, world.cells)


class _World:
    """The cells of a world and their radiance (n, 3): from the panorama, and finer ones from closer looks."""

    def __init__(self, radiance: np.ndarray, look: Look) -> None:
        self.cells, self._look = panorama_cells(*radiance.shape[:2]), look
        self.radiance = clean(radiance)

    def least(self) -> float:
        """The least light of a part that is worth a source, summed over the colours."""
        return LEAST_SHARE * float(np.sum(self.radiance * self.cells.solid_angles[:, None]))

    def seen_closely(self, source: Source) -> Source:
        """Fit a narrow source again in closer looks; a wide source stays as it is."""
        for _ in range(_LOOKS if source.cone_radius < _NARROW_ENOUGH else 0):
            half_angle = _LOOK_RADII * source.cone_radius
            crop = crop_cells(LOOK_SIZE, half_angle, source.direction)
            seen = clean(self._look(source.direction, half_angle, LOOK_SIZE))
            self._take(crop, seen, half_angle)
            source = refit(source, seen, crop)
            if source.cone_radius >= _RESOLVED_PIXELS * 2 * half_angle / LOOK_SIZE:
                break
        return source

    def _take(self, crop: Cells, seen: np.ndarray, half_angle: float) -> None:
        left = _uncovered(self.cells, crop, half_angle)
        kept, old = left > 0, self.cells
        rest = left[kept]
        self.cells = Cells(
            np.concatenate((old.directions[kept], crop.directions)),
            np.concatenate((old.solid_angles[kept] * rest, crop.solid_angles)),
            np.concatenate((old.moments[kept] * rest[:, None], crop.moments)),
        )
        self.radiance = np.concatenate((self.radiance[kept], seen))


def _uncovered(cells: Cells, crop: Cells, half_angle: float) -> np.ndarray:
    """The share of each cell (n,) that a crop does not cover.

    Each cell of the crop is subtracted from the nearest cell. Well inside the crop it is 0: a sun counts once."""
    towards = crop.moments.sum(axis=0)
    near = np.flatnonzero(inside_crop(cells.directions, 1.3 * half_angle, towards))
    left = np.ones(len(cells.directions))
    if len(near):
        nearest = np.argmax(crop.directions @ cells.directions[near].T, axis=1)
        covered = np.bincount(nearest, crop.solid_angles, len(near)) / cells.solid_angles[near]
        left[near] = np.maximum(1 - covered, 0)
    left[inside_crop(cells.directions, 0.75 * half_angle, towards)] = 0
    return left


def _is_same(one: Source, other: Source) -> bool:
    """Whether two narrow sources became one in a closer look: each lies in the other's cone, and their widths are
    similar. Pieces of a wide source may lie in each other's cones too."""
    narrow, wide = sorted((one, other), key=lambda source: source.variance)
    is_near = owners([narrow], wide.direction[None])[0] == 0
    return is_near and wide.cone_radius < _NARROW_ENOUGH and wide.variance < 4 * narrow.variance
