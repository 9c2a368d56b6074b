# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds as panoramas: a room, an overcast sky and a studio.

python -m sample_scenes.room --output room.exr [--rows 512 --seed 1]

Each is the radiance (rows, 2 rows, 3), laid out as precompute/world_sources/sources.py says. The room has two windows,
two ceiling panels and a warm lamp, seen from its centre. Its picture is in the public domain (CC0). Each point of a
wall shows direct light from the bright parts, shaded by the furniture, and a constant for the light between walls."""

import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from precompute.base.files import write_whole
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser, exit_status
from precompute.table.atlas import write_exr
from precompute.world_sources.sources import panorama_cells

# Direction, width and height in degrees, and radiance of each soft box.
BOXES = (
    ((0.6, -0.5, 0.75), 30, 20, (10.0, 10.0, 10.0)),
    ((-0.8, -0.3, 0.6), 16, 16, (5.0, 5.2, 5.6)),
    ((-0.1, 0.9, 0.5), 6, 40, (12.0, 11.4, 10.4)),
)


def overcast(rows: int) -> np.ndarray:
    """The CIE overcast sky over dark ground."""
    height = panorama_cells(rows, 2 * rows).directions[:, 2]
    edge = np.clip(height * rows / np.pi + 0.5, 0, 1)
    grey = 0.3 * (edge * (1 + 2 * np.maximum(height, 0)) / 3 + (1 - edge) * 0.1)
    return np.repeat(grey.reshape(rows, 2 * rows, 1), 3, axis=2)


def soft_boxes(rows: int) -> np.ndarray:
    """A studio: key, fill and strip light on a dim gradient."""
    directions = panorama_cells(rows, 2 * rows).directions
    grey = 0.06 * (1.2 + directions[:, 2])
    colour = np.repeat(grey[:, None], 3, axis=1)
    for towards, wide_deg, high_deg, shine in BOXES:
        forward = np.array(towards) / np.linalg.norm(towards)
        left = np.cross((0, 0, 1), forward)
        left /= np.linalg.norm(left)
        z = directions @ forward
        inside = np.where(z > 0, 1.0, 0.0)
        for axis, degrees in ((left, wide_deg), (np.cross(forward, left), high_deg)):
            off = np.abs(np.arctan2(directions @ axis, np.maximum(z, 1e-9)))
            inside = inside * np.clip((np.radians(degrees / 2) - off) * rows / np.pi + 0.5, 0, 1)
        colour += inside[:, None] * np.array(shine)
    return colour.reshape(rows, 2 * rows, 3)


# Corners of the room in metres: x towards the windows, z up, the viewer at 0.
LOW, HIGH = np.array((-2.6, -2.3, -1.3)), np.array((2.4, 2.9, 1.4))
# Albedo of each wall: low and high end of x, y, z.
_WALLS = np.array([[(0.66, 0.63, 0.57)] * 2, [(0.60, 0.62, 0.60)] * 2, [(0.30, 0.19, 0.11), (0.80, 0.80, 0.78)]])
_PLANK_M, _SKIRTING_M, _BAR_M = 0.16, 0.09, 0.03
# Light between walls: a constant irradiance.
_EVEN = np.array((0.55, 0.50, 0.44))
# Samples per side of a panel.
_POINTS = 3


@dataclass(frozen=True)
class Panel:
    """A bright rectangle in a wall. `axis` is the wall's axis, `end` is 0 at its low end and 1 at its high end. `low`
    and `high` are the corners along the other two axes, in metres. `bars`: it is a window with a cross."""

    axis: int
    end: int
    low: tuple[float, float]
    high: tuple[float, float]
    radiance: tuple[float, float, float]
    bars: bool = False


@dataclass(frozen=True)
class Block:
    """A piece of furniture: corners and albedo. The lamp's shade also emits light."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    albedo: tuple[float, float, float]
    radiance: tuple[float, float, float] = (0.0, 0.0, 0.0)


PANELS = (
    Panel(0, 1, (-1.7, -0.35), (-0.5, 1.1), (5.2, 6.0, 7.2), bars=True),
    Panel(0, 1, (0.5, -0.35), (1.7, 1.1), (5.2, 6.0, 7.2), bars=True),
    Panel(2, 1, (-1.6, -0.9), (-1.3, 0.9), (11.0, 10.4, 9.2)),
    Panel(2, 1, (0.7, -0.9), (1.0, 0.9), (11.0, 10.4, 9.2)),
)
BLOCKS = (
    Block((-2.4, -1.7, -1.3), (-1.5, 0.6, -0.85), (0.07, 0.11, 0.17)),  # a sofa, and its back
    Block((-2.6, -1.7, -0.85), (-2.3, 0.6, -0.45), (0.07, 0.11, 0.17)),
    Block((-0.5, 1.5, -0.9), (0.8, 2.2, -0.84), (0.22, 0.12, 0.06)),  # a table top
    Block((-2.45, 2.05, -1.3), (-2.4, 2.1, 0.1), (0.05, 0.05, 0.05)),  # a lamp's stand, and its shade
    Block((-2.6, 1.9, 0.1), (-2.25, 2.25, 0.45), (0.8, 0.7, 0.5), (6.5, 4.0, 1.9)),
    Block((-0.9, -2.3, -0.1), (0.4, -2.26, 0.8), (0.10, 0.04, 0.03)),  # a picture on the wall
)


def room(rows: int, seed: int = 1) -> np.ndarray:
    """The room's radiance (rows, 2 rows, 3) in linear Rec.709, laid out as precompute/world_sources/sources.py says; a
    mean of four directions in each pixel."""
    fine = _seen(panorama_cells(2 * rows, 4 * rows).directions, np.random.default_rng(seed))
    return fine.reshape(rows, 2, 2 * rows, 2, 3).mean(axis=(1, 3))


def _seen(directions: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Radiance (n, 3) that the viewer sees in directions (n, 3)."""
    with np.errstate(divide="ignore"):
        ends = np.where(directions > 0, HIGH, LOW) / directions
    axis = ends.argmin(axis=1)
    distance = ends[np.arange(len(axis)), axis]
    at = directions * distance[:, None]
    normal = -np.sign(directions) * (np.arange(3) == axis[:, None])
    end = (normal[np.arange(len(axis)), axis] < 0).astype(int)
    albedo, shines = _WALLS[axis, end], np.zeros((len(at), 3))
    floor, wall = (axis == 2) & (end == 0), axis != 2
    planks = random.uniform(0.75, 1.25, (64, 8))
    x, y = at[:, 0] - LOW[0], at[:, 1] - LOW[1]
    row = (x // _PLANK_M).astype(int)
    albedo[floor] *= planks[row % 64, ((y + 0.37 * row) // 1.3).astype(int) % 8][floor, None]
    albedo[wall & (at[:, 2] < LOW[2] + _SKIRTING_M)] *= 0.5
    for panel in PANELS:
        held = (axis == panel.axis) & (end == panel.end) & _inside(panel, at)
        shines[held] = np.array(panel.radiance) * _sky(panel, at[held])[:, None]
    for block in BLOCKS:
        near, side = _enter(block, np.zeros(3), directions)
        nearer = near < distance
        distance = np.where(nearer, near, distance)
        at[nearer] = directions[nearer] * near[nearer, None]
        normal[nearer] = -np.sign(directions[nearer]) * (np.arange(3) == side[nearer, None])
        albedo[nearer], shines[nearer] = block.albedo, block.radiance
    return shines + albedo / np.pi * (_light(at + 1e-4 * normal, normal) + _EVEN)


def _light(at: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Irradiance (n, 3) at points (n, 3) from panels and the lamp's shade, with shadows of the furniture."""
    total = np.zeros_like(at)
    for panel in PANELS:
        others = [axis for axis in range(3) if axis != panel.axis]
        size = np.subtract(panel.high, panel.low)
        steps = (np.arange(_POINTS) + 0.5) / _POINTS
        facing = (panel.end == 0) * 2.0 - 1
        for first in steps:
            for second in steps:
                source = np.empty(3)
                source[panel.axis] = (LOW, HIGH)[panel.end][panel.axis]
                source[others] = panel.low + size * (first, second)
                away = source - at
                squared = (away**2).sum(axis=1)
                cosines = np.maximum((away * normal).sum(axis=1), 0) * np.maximum(-away[:, panel.axis] * facing, 0)
                seen = cosines / np.maximum(squared, 0.01) ** 2 * size.prod() / _POINTS**2
                lit = np.flatnonzero(seen)
                for block in BLOCKS[:3]:  # these are below the panels and shade only lower points
                    low = lit[at[lit, 2] < block.high[2]]
                    seen[low[_enter(block, at[low], away[low])[0] < 1]] = 0
                total[lit] += seen[lit, None] * panel.radiance
    shade = next(block for block in BLOCKS if any(block.radiance))
    away = np.add(shade.low, shade.high) / 2 - at
    squared = (away**2).sum(axis=1)
    area = np.prod(np.subtract(shade.high, shade.low)[:2])
    lit = np.maximum((away * normal).sum(axis=1), 0) / np.maximum(squared, 0.05) ** 1.5 * area
    return total + lit[:, None] * shade.radiance


def _enter(block: Block, start: np.ndarray, towards: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where rays (n, 3) enter a block: the distance in ray lengths (infinity if they miss), and the axis of the
    face."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(np.array(corner) - start) / towards for corner in (block.low, block.high)])
    near, far = np.nan_to_num(ends.min(axis=0), nan=-np.inf), ends.max(axis=0)
    first = near.max(axis=1)
    hit = (first < far.min(axis=1)) & (first > 0)
    return np.where(hit, first, np.inf), near.argmax(axis=1)


def _inside(panel: Panel, at: np.ndarray) -> np.ndarray:
    """Which points (n, 3) of its wall a panel covers, without a window's bars."""
    across = np.delete(at, panel.axis, axis=1)
    inside = ((across > panel.low) & (across < panel.high)).all(axis=1)
    if panel.bars:
        inside &= (np.abs(across - np.add(panel.low, panel.high) / 2) > _BAR_M).all(axis=1)
    return inside


def _sky(panel: Panel, at: np.ndarray) -> np.ndarray:
    """The brightness (n,) behind a panel: constant, or for a window, a sky that is brighter higher up, above dark
    houses."""
    if not panel.bars:
        return np.ones(len(at))
    rise = at[:, 2] / np.linalg.norm(at[:, :2], axis=1)
    return np.where(rise > -0.02, 0.75 + rise, 0.12)


def main(argv: list[str] | None = None) -> int:
    """Write the picture. Returns the exit status."""
    parser = OneLineParser(prog="sample_scenes.room", description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.exr")
    parser.add_argument("--rows", type=count(16, 4096), default=512)
    parser.add_argument("--seed", type=count(0, 1 << 30), default=1)
    arguments = parser.parse_args(argv)
    picture = room(arguments.rows, arguments.seed).astype(np.float32)
    write = partial(write_exr, image=picture, attributes={"comments": "CC0"})
    return exit_status(lambda: write_whole(arguments.output, write))


if __name__ == "__main__":
    sys.exit(main())
