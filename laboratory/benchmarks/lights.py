# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders under worlds, compared with integrals of the table at points of the subject.

    ./dev bench lights [--subject snake] [--world studio] [--points 200] [--samples 1024] [--json FILE|-]

Each row is a subject, a world and a surface. It gives the median and the 95th percentile of the CIEDE2000 between
render and integral over the points, at the exposure that puts the 99th percentile of the integrals' Y at display white.
`light` is the ratio of the render's total Y to the integrals'. Both figures are given for all the light, and for the
scattered light without the mirror image, from a bake whose zero order is zero. `noise` is the render's own noise: half
the median difference between two renders of half the samples each (`--samples`).
"""

import argparse
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.colour.spaces import rgb_from_xyz
from precompute.table import atlas
from precompute.table.sample_set import path_beside

from . import lights_scenes as scenes
from . import report
from .blender import colour_differences
from .hemisphere import Surface, without_mirror
from .lights_scenes import SURFACES, Worlds

# Pixels per side of a subject's picture.
PIXELS = {"snake": 56, "sphere": 28}
# Worlds in which All has negligible noise at these samples.
_ALL_CONVERGES = ("studio", "overcast sky")
_LUMINANCE = np.linalg.inv(rgb_from_xyz("Rec.709"))[1]
_WORST = 5


def main(argv: list[str] | None = None) -> int:
    """Print the table and return the exit status."""
    parser = OneLineParser(prog="./dev bench lights", description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=count(1, 100_000), default=200, help="of a subject")
    parser.add_argument("--samples", type=count(2, 1 << 20), default=1024, help="of a pixel")
    parser.add_argument("--subject", action="append", choices=scenes.SUBJECTS)
    parser.add_argument("--world", action="append", choices=scenes.WORLDS)
    parser.add_argument("--surface", action="append", choices=SURFACES)
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        rows = truth(Worlds.started(Path(folder), max(PIXELS.values())), arguments)
    report.write({"truth": rows}, arguments.json)
    return 0


def truth(studio: Worlds, arguments: argparse.Namespace) -> list[dict]:
    """A row for each subject, world, surface, choice of lights and part of the light."""
    rows = []
    report.say(
        f"{'subject':8}{'world':14}{'surface':20}{'lights':7}{'part':11}{'dE50':>6}{'dE95':>6}{'light':>7}"
        f"{'noise':>7}{'sources':>9}{'missed':>8}", arguments.json,
    )  # fmt: skip
    worlds = arguments.world or scenes.WORLDS
    bakes = list(studio.bakes(arguments.surface or SURFACES))
    for subject in arguments.subject or scenes.SUBJECTS:
        studio.build(subject)
        points = scenes.free_points(studio, PIXELS[subject], arguments.points)
        lights = {world: studio.light_by(world) for world in worlds}
        wanted = {name: integrals(Surface.of(atlas.read(bake)[0]), points, lights) for name, bake in bakes}
        for world in worlds:
            studio.light_by(world)
            for name, bake in bakes:
                scattered, mirrored = wanted[name][world]
                for lights, part, picture in pictures(
                    studio, bake, world=world, size=(PIXELS[subject], arguments.samples)
                ):
                    expected = scattered if part == "scattered" else scattered + mirrored
                    row = {"subject": subject, "world": world, "surface": name, "lights": lights, "part": part}
                    row |= compared(picture[:, *points.pixels], expected)
                    row |= {
                        "points": len(expected),
                        "sources": studio.addon.sky.source_count(studio.scene),
                        "missed": studio.addon.sky.missed_share(studio.scene),
                    }
                    rows.append(row)
                    report.say(
                        f"{subject:8}{world:14}{name:20}{lights:7}{part:11}{row['de_median']:6.2f}{row['de_p95']:6.2f}"
                        f"{row['light']:7.3f}{row['noise']:7.2f}{row['sources']:9}{row['missed']:8.3f}",
                        arguments.json,
                    )
    return rows


def integrals(surface: Surface, points: scenes.Points, lights: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Scattered and mirrored radiance (2, n, 3) at the points, by the name of the world."""
    found = np.zeros((len(lights), 2, len(points.positions), 3))
    panoramas = np.concatenate(list(lights.values()), axis=2)
    for index, (frame, wr) in enumerate(zip(points.frames, points.views, strict=True)):
        wi, mirrored = surface.mirrored(wr)
        parts = (surface.directions @ frame, surface.scattered(wr)), (wi @ frame, mirrored)
        for part, (directions, answers) in enumerate(parts):
            seen = scenes.looked_up(panoramas, directions).reshape(len(directions), -1, 3)
            found[:, part, index] = np.einsum("nlc,nc->lc", seen, answers)
    return dict(zip(lights, found, strict=True))


def compared(pictures: np.ndarray, expected: np.ndarray) -> dict:
    """The figures of a row, from two renders (2, n, 3) of the points and their integrals (n, 3)."""
    picture = pictures.mean(axis=0)
    differences = colour_differences(picture, expected)
    errors = np.abs(picture - expected) @ _LUMINANCE
    noise = colour_differences(*pictures) if pictures.any() else np.zeros(1)
    worst = np.argsort(errors)[::-1][:_WORST]
    return {
        "de_median": float(np.median(differences)),
        "de_p95": float(np.percentile(differences, 95)),
        "light": float((picture @ _LUMINANCE).sum() / (expected @ _LUMINANCE).sum()),
        "noise": float(np.median(noise) / 2),
        "counted": len(differences),
        "worst": [{"point": int(i), "render": picture[i].tolist(), "integral": expected[i].tolist()} for i in worst],
    }


def pictures(studio: Worlds, bake: Path, *, world: str, size: tuple[int, int]) -> Iterator[tuple[str, str, np.ndarray]]:
    """The choice of lights, the part of the light, and two renders (2, rows, columns, 3) of a bake, for each. `size` is
    the pixels per side and the total samples of both renders."""
    scattering = scattering_bake(studio, bake)
    choices = [("REST", "whole", bake), ("REST", "scattered", scattering)]
    if world in _ALL_CONVERGES:
        choices.append(("ALL", "whole", bake))
    for lights, part, path in choices:
        material, skin = studio.material(path, lights)
        skin.inputs["Base Color"].default_value = (0, 0, 0, 1)
        studio.mesh.material_slots[0].material = material
        studio.addon.fitting_worlds.fit_world(studio.scene)
        yield lights, part, two_halves(studio, *size)


def scattering_bake(studio: Worlds, bake: Path) -> Path:
    """The bake without its zero order."""
    scattering = studio.folder / f"{bake.stem}-scattered.exr"
    if not scattering.is_file():
        image, layout = atlas.pack(without_mirror(atlas.read(bake)[0]))
        atlas.write_together({scattering: (image, layout)}, {"precision": str(image.dtype)})
        shutil.copyfile(path_beside(bake), path_beside(scattering))
    return scattering


def two_halves(studio: Worlds, pixels: int, samples: int) -> np.ndarray:
    """Two pictures (2, pixels, pixels, 3) with half the samples each and independent noise."""
    halves = []
    for studio.scene.cycles.seed in (0, 1):
        halves.append(studio.render((samples + 1) // 2, pixels))
    return np.stack(halves)
