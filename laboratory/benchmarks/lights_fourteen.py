# SPDX-License-Identifier: GPL-3.0-or-later
"""A sphere in fourteen worlds by *Lamps and World*, compared with integrals of the table over the hemisphere.

Each row is a world. It gives the median and the 95th percentile of the CIEDE2000 at points of the sphere, at the
exposure of lights_truth.py, of all the light and of the scattered light without the mirror image. `noise` is the part
of the scattered light's median that comes from the noise of the render.

`light` is the scattered light (Y) of a picture of the sphere's middle over that of the table (lights_area.py). `error`
is its standard error: that of the table's mean, and that of two renders with half the samples each. A `light` that is
many errors away from 1 is biased. The surface is `sample:elaphe` over black.

The worlds are painted panoramas, except for two Sky Textures and a lamp. Small bright lights are summed pixel by pixel,
because the directions of the hemisphere are too far apart for them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from precompute.table import atlas
from precompute.world_sources.sources import crop_frame, panorama_cells
from sample_scenes.panoramas import overcast, soft_boxes
from sample_scenes.room import room

from . import lights_scenes as scenes
from . import report
from .hemisphere import Surface
from .lights_area import mean_light
from .lights_truth import LUMINANCE, PIXELS, compared, integrals, scattering_bake, two_halves
from .lights_worlds import SURFACES, Worlds

ROWS = 512
# Lights of fewer pixels are summed finer: this many pixels a side.
_SMALL, _FINER = 2500, 4
_SUN_DEG = 0.6
# The picture whose light is measured shows the sphere's middle, seen at up to 74 degrees. The rim is not measured.
_MIDDLE = np.radians(26.5)
_FRAMES_A_TURN = 250


@dataclass(frozen=True)
class Painted:
    """Luminance (ROWS, 2 ROWS) of a world: smooth light, and small bright lights."""

    smooth: np.ndarray
    bright: np.ndarray


def worlds_against_integrals(studio: Worlds, arguments: argparse.Namespace) -> list[dict]:
    """A row for each world."""
    name, bake = next(studio.bakes(SURFACES[:1]))
    scenes.build(studio, "sphere")
    points = scenes.free_points(studio, PIXELS["sphere"], arguments.points)
    chosen = arguments.fourteen or list(FOURTEEN)
    surface, scattering = Surface.of(atlas.read(bake)[0]), scattering_bake(studio, bake)
    lights = {world: FOURTEEN[world](studio) for world in chosen}
    wanted = integrals(surface, points, lights)
    rows = []
    report.say(
        f"{'world':22}{'whole:':>7}{'dE50':>5}{'dE95':>6}{'scattered:':>12}{'dE50':>5}{'dE95':>6}{'noise':>7}{'light':>8}"
        f"{'error':>7}{'sources':>9}{'missed':>8}", arguments.json,
    )  # fmt: skip
    for world in chosen:
        FOURTEEN[world](studio)
        scattered, mirrored = wanted[world]
        row = {"world": world, "surface": name, "points": len(scattered)}
        for part, path, expected in (("whole", bake, scattered + mirrored), ("scattered", scattering, scattered)):
            studio.dress_sphere(path)
            picture = two_halves(studio, PIXELS["sphere"], arguments.samples)[:, *points.pixels]
            row[part] = compared(picture, expected)
        row["light"], row["error"] = light_of_picture(studio, surface, lights[world], arguments.samples)
        row["sources"] = studio.addon.sky.source_count(studio.scene)
        row["missed"] = studio.addon.sky.missed_share(studio.scene)
        rows.append(row)
        whole, scattered = row["whole"], row["scattered"]
        report.say(
            f"{world:22}{whole['de_median']:12.2f}{whole['de_p95']:6.2f}{scattered['de_median']:17.2f}"
            f"{scattered['de_p95']:6.2f}{scattered['noise']:7.2f}{row['light']:8.3f}{row['error']:7.3f}"
            f"{row['sources']:9}{row['missed']:8.3f}",
            arguments.json,
        )
    return rows


def light_of_picture(studio: Worlds, surface: Surface, light: scenes.Light, samples: int) -> tuple[float, float]:
    """The mean Y of a picture of the sphere's middle in its present material over that of the table, and its standard
    error."""
    faces, cycles, lens = studio.mesh.data.polygons, studio.scene.cycles, studio.scene.camera.data
    chosen = np.empty(len(faces), np.int32)
    faces.foreach_get("material_index", chosen)
    faces.foreach_set("material_index", np.zeros_like(chosen))
    # Each pixel is the mean of its area.
    before = cycles.pixel_filter_type, lens.angle
    cycles.pixel_filter_type, lens.angle = "BOX", _MIDDLE
    halves = two_halves(studio, PIXELS["sphere"], samples) @ LUMINANCE
    expected, error = mean_light(studio.scene.camera, surface.scattering, light)
    cycles.pixel_filter_type, lens.angle = before
    faces.foreach_set("material_index", chosen)
    ratio = halves.mean() / expected
    noise = np.sqrt(((halves[0] - halves[1]) ** 2).sum()) / 2 / halves[0].size / expected
    return float(ratio), float(np.hypot(noise, ratio * error / expected))


def light_of(painted: Painted) -> scenes.Light:
    """The light of a painted world, its bright lights as a lamp in each pixel."""
    lit = painted.bright > 0
    rows, cols = np.nonzero(_grown(lit))
    finer = _FINER if lit.sum() < _SMALL else 1
    step = (np.arange(finer) + 0.5) / finer
    y = (rows[:, None, None] + step[:, None]) / ROWS * np.pi - np.pi / 2
    x = np.pi - (cols[:, None, None] + step) / ROWS * np.pi
    up, around = (each.ravel() for each in np.broadcast_arrays(y, x))
    directions = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=-1)
    area = (np.pi / ROWS / finer) ** 2 * np.cos(up)
    irradiance = scenes.looked_up(painted.bright[..., None], directions) * area[:, None]
    # A disc of the area of a pixel at the horizon.
    variance = (np.pi / ROWS / finer) ** 2 / (4 * np.pi)
    return scenes.Light(_grey(painted.smooth), directions, np.repeat(irradiance, 3, axis=1), variance)


def _grown(lit: np.ndarray) -> np.ndarray:
    """The pixels that the bright ones reach when the picture is interpolated."""
    wide = lit | np.roll(lit, 1, axis=1) | np.roll(lit, -1, axis=1)
    tall = wide.copy()
    tall[1:] |= wide[:-1]
    tall[:-1] |= wide[1:]
    return tall


def _grey(luminance: np.ndarray) -> np.ndarray:
    return np.repeat(luminance[..., None], 3, axis=2).astype(np.float32)


def _paint(make: Callable[[], Painted]) -> Callable[[Worlds], scenes.Light]:
    def light(studio: Worlds) -> scenes.Light:
        scenes.without_lamps(studio)
        painted = make()
        studio.paint(_grey(painted.smooth + painted.bright))
        return light_of(painted)

    return light


def _picture(make: Callable[[int], np.ndarray]) -> Callable[[Worlds], scenes.Light]:
    def light(studio: Worlds) -> scenes.Light:
        scenes.without_lamps(studio)
        radiance = make(ROWS)
        studio.paint(radiance)
        return scenes.Light(radiance.astype(np.float32))

    return light


def _directions() -> np.ndarray:
    return panorama_cells(ROWS, 2 * ROWS).directions


def towards(up_deg: float, around_deg: float) -> np.ndarray:
    up, around = np.radians((up_deg, around_deg))
    return np.array((np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)))


def _shaped(values: np.ndarray) -> np.ndarray:
    return values.reshape(ROWS, 2 * ROWS)


def _gradient(bottom: float = 0.05, top: float = 0.3) -> np.ndarray:
    return _shaped(bottom + (top - bottom) * (1 + _directions()[:, 2]) / 2)


def _disc(at: np.ndarray, radius_deg: float) -> np.ndarray:
    """A disc of radiance 1 with an edge of a pixel."""
    off = np.degrees(np.arccos(np.clip(_directions() @ at, -1, 1)))
    return _shaped(np.clip((radius_deg - off) * ROWS / 180 + 0.5, 0, 1))


def _box(at: np.ndarray, wide_deg: float, high_deg: float) -> np.ndarray:
    x, y, z = (_directions() @ crop_frame(at)).T
    beside, above = np.degrees(np.arctan2(y, x)), np.degrees(np.arcsin(np.clip(z, -1, 1)))
    sides = [(np.abs(beside), wide_deg), (np.abs(above), high_deg)]
    return _shaped(np.prod([np.clip((size / 2 - off) * ROWS / 180 + 0.5, 0, 1) for off, size in sides], axis=0))


def _forty_windows(_: int) -> np.ndarray:
    """Four rows of ten windows, 8 x 6 degrees, of uneven brightness in a grey wall."""
    strength = np.random.default_rng(5).uniform(2, 8, 40)
    places = [(up, 36 * column + 18 * row) for row, up in enumerate((10, 28, 46, 64)) for column in range(10)]
    windows = (shine * _box(towards(*at), 8, 6) for shine, at in zip(strength, places, strict=True))
    return _grey(sum(windows, start=_gradient(0.1, 0.1)))


def _boxes_and_sun() -> Painted:
    boxes = 6 * _box(towards(35, -130), 24, 16) + 4 * _box(towards(50, -20), 14, 14)
    return Painted(_gradient() + boxes, 20000 * _disc(towards(40, -75), _SUN_DEG))


def _sun_at(up_deg: float, around_deg: float) -> Callable[[], Painted]:
    return lambda: Painted(_gradient(), 20000 * _disc(towards(up_deg, around_deg), _SUN_DEG))


def _two_suns() -> Painted:
    return Painted(
        _gradient(), 20000 * _disc(towards(40, -100), _SUN_DEG) + 8000 * _disc(towards(25, -40), 1.5 * _SUN_DEG)
    )


def _strip() -> Painted:
    return Painted(_gradient(0.02, 0.05), 40 * _box(towards(40, -90), 60, 2))


def _many_lamps() -> Painted:
    """A city at night: 300 lamps of a degree above and below the horizon, whose brightness spans a factor of 100."""
    random = np.random.default_rng(8)
    up, around = np.degrees(np.arcsin(random.uniform(-0.3, 0.9, 300))), random.uniform(-180, 180, 300)
    strength = 10 ** random.uniform(0.5, 2.5, 300)
    lamps = (shine * _disc(towards(*at), 0.5) for shine, *at in zip(strength, up, around, strict=True))
    return Painted(_gradient(0.02, 0.01), sum(lamps))


def _sky(studio: Worlds) -> scenes.Light:
    from sample_scenes import stage

    scenes.without_lamps(studio)
    stage.light_by_sky(studio.scene, stage.SUN_AZIMUTH_DEG, stage.SUN_ELEVATION_DEG)
    return scenes.light_of_sky(studio, ROWS)


def _animated(studio: Worlds) -> scenes.Light:
    """A sky that a driver turns once in 250 frames. The scene stays at its first frame."""
    from sample_scenes import stage

    scenes.without_lamps(studio)
    stage.light_by_sky(studio.scene, stage.SUN_AZIMUTH_DEG, stage.SUN_ELEVATION_DEG)
    tree = studio.scene.world.node_tree
    sky = next(node for node in tree.nodes if node.type == "TEX_SKY")
    start = sky.sun_rotation
    curve = sky.driver_add("sun_rotation")
    curve.driver.expression = f"{start} + (frame - 1) * {2 * np.pi / _FRAMES_A_TURN}"
    studio.scene.frame_set(1)
    return scenes.light_of_sky(studio, ROWS)


def _lamp(studio: Worlds) -> scenes.Light:
    light = scenes.light_by(studio, "area lamp")
    return scenes.Light(np.zeros((ROWS, 2 * ROWS, 3), np.float32), square=light.square)


FOURTEEN: dict[str, Callable[[Worlds], scenes.Light]] = {
    "soft boxes": _picture(soft_boxes),
    "clear sky": _sky,
    "overcast sky": _picture(overcast),
    "room": _picture(room),
    "area lamp": _lamp,
    "40 windows": _picture(_forty_windows),
    "animated sky": _animated,
    "boxes and a small sun": _paint(_boxes_and_sun),
    "sun on the seam": _paint(_sun_at(40, -180)),
    "sun at the zenith": _paint(_sun_at(90, 0)),
    "two suns": _paint(_two_suns),
    "strip light": _paint(_strip),
    "even white": _picture(lambda rows: np.ones((rows, 2 * rows, 3))),
    "300 lamps": _paint(_many_lamps),
}
