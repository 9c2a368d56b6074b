# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffraction under lamps and worlds: a white furnace, and noise at equal time compared with an ordinary coat.

    ./dev bench lights [--part furnace|noise|scattered|truth|fakes|worlds ...] [--pixels 192] [--json FILE|-]

**Furnace**: a plane in a white world shows the directional albedo of its relief. The table gives Cycles' value divided
by the integral of the bake's own table over the hemisphere, and the share of the light (Y) that comes back. Surfaces
are skins of keratin, and a blaze in a mirror, in gold and under layers. Real scans are left out if their files are
missing.

**Noise**: the sample snake on its ground under worlds, as an artist renders it, with each choice of lights. For
comparison the same skin gets an ordinary Principled coat of IOR 1.56 and roughness 0.3, or a sharp coat with the
roughness of the relief's mirror image, 0.08. The figure is the RMSE of the whole picture against the material's own
picture of many samples, times the square root of the processor time: the noise at equal time. Pixels are clipped at
display white. Samples are not clipped: clipping would remove light, and less of it the more a footprint blurs. `us` is
the processor time of a sample of a pixel in microseconds. `clean` is the number of samples for an RMSE of 2 % of
display white. `denoised` is the RMSE after Cycles' denoiser, and `dE` the median CIEDE2000 of the denoised picture over
the lit pixels.

**Scattered**: the noise of the scattered light alone, compared with a coat alone (lights_scattered.py).

**Truth**: renders under worlds and a large lamp, compared with integrals of the table (lights_truth.py).

**Fakes**: artists' substitutes for a measured surface, compared with the same integrals (lights_fakes.py).

**Worlds**: a sphere in fourteen worlds, compared with the same integrals (lights_fourteen.py).
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.table import atlas

from . import lights_scenes as scenes
from . import report
from .hemisphere import directional_albedo, directional_albedo_xyz
from .lights_fakes import fakes
from .lights_fourteen import FOURTEEN, worlds_against_integrals
from .lights_scattered import scattered
from .lights_truth import truth
from .lights_worlds import SAMPLES, SURFACES, WORLDS, Worlds

PARTS = ("furnace", "noise", "scattered", "truth", "fakes", "worlds")
ANGLES_DEG = (0, 30, 60, 75, 80, 85)
MATERIALS = ("coat", "sharp coat", "LAMPS", "REST", "ALL")
# The RMSE that counts as clean, relative to display white.
_CLEAN = 0.02


def main(argv: list[str] | None = None) -> int:
    """Print the tables and return the exit status."""
    parser = OneLineParser(prog="./dev bench lights", description=__doc__.splitlines()[0])
    parser.add_argument("--part", action="append", choices=PARTS)
    parser.add_argument("--pixels", type=count(4, 8192), default=192)
    parser.add_argument("--points", type=count(1, 100_000), default=200, help="of a subject; not in furnace and noise")
    parser.add_argument("--samples", type=count(2, 1 << 20), default=1024, help="of a pixel; not in furnace and noise")
    parser.add_argument("--subject", action="append", choices=scenes.SUBJECTS, help="in truth and fakes")
    parser.add_argument("--world", action="append", choices=scenes.WORLDS, help="not in furnace and worlds")
    parser.add_argument("--surface", action="append", choices=SURFACES, help="in scattered, truth and fakes")
    parser.add_argument("--fourteen", action="append", choices=FOURTEEN, help="a world of the part worlds")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    facts = {}
    with tempfile.TemporaryDirectory() as folder:
        studio = Worlds.started(Path(folder), arguments.pixels)
        for part in arguments.part or PARTS:
            facts[part] = _MEASURES[part](studio, arguments)
    report.write(facts, arguments.json)
    return 0


def furnace(studio: Worlds, arguments: argparse.Namespace) -> list[dict]:
    """A row for each surface, choice of lights and angle: the render relative to the directional albedo, linear RGB."""
    rows = []
    report.say(f"{'surface':40}{'lights':>7}{'angle':>7}   render / albedo in R, G, B; share of light", arguments.json)
    for name, bake in (*studio.bakes(), *studio.blazes()):
        table = atlas.read(bake)[0]
        albedo = {angle: directional_albedo(table, np.radians(angle)) for angle in ANGLES_DEG}
        share = {angle: float(directional_albedo_xyz(table, np.radians(angle))[1]) for angle in ANGLES_DEG}
        for lights in ("REST", "ALL"):
            for angle in ANGLES_DEG:
                found = studio.furnace(bake, lights, np.radians(angle))
                rows.append(
                    {
                        "surface": name,
                        "lights": lights,
                        "angle_deg": angle,
                        "albedo": albedo[angle].tolist(),
                        "share": share[angle],
                        "ratio": (found / albedo[angle]).tolist(),
                    }
                )
                ratio = " ".join(f"{each:.4f}" for each in rows[-1]["ratio"])
                report.say(f"{name:40}{lights:>7}{angle:7}   {ratio}; {share[angle]:.3f}", arguments.json)
    return rows


def noise(studio: Worlds, arguments: argparse.Namespace) -> list[dict]:
    """A row for each world and material."""
    rows = []
    report.say(
        f"{'world':14}{'material':>11}{'us':>7}{'RMSE':>9}{'to coat':>9}{'clean':>7}{'denoised':>10}{'dE':>6}",
        arguments.json,
    )
    for world in arguments.world or scenes.WORLDS:
        studio.build("snake")
        if world in WORLDS:
            studio.light_by(world)
        else:
            studio.target = np.zeros(3)
            scenes.light_by(studio, world)
        coat = None
        for material in MATERIALS:
            studio.dress(material)
            row = studio.noise()
            figure = row["rmse"] * row["us"] ** 0.5
            coat = figure if coat is None else coat
            row |= {
                "world": world,
                "material": material,
                "to_coat": figure / coat,
                "clean": SAMPLES * (row["rmse"] / _CLEAN) ** 2,
                "sources": studio.addon.sky.source_count(studio.scene),
            }
            rows.append(row)
            report.say(
                f"{world:14}{material:>11}{row['us']:7.2f}{row['rmse']:9.5f}{row['to_coat']:9.2f}{row['clean']:7.1f}"
                f"{row['denoised']:10.5f}{row['denoised_de']:6.2f}",
                arguments.json,
            )
    return rows


_MEASURES = {
    "furnace": furnace, "noise": noise, "scattered": scattered, "truth": truth, "fakes": fakes,
    "worlds": worlds_against_integrals,
}  # fmt: skip
