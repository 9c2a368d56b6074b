# SPDX-License-Identifier: GPL-3.0-or-later
"""Render time and noise in Cycles under 1, 3, 8 and 32 suns.

    ./dev --bpy 5.2 bench many_lamps [--scene sphere --scene snake] [--lamps N]... [--pixels 96] [--repeat 3]
        [--flicker] [--json FILE|-]

Time is measured as in render_time, relative to a Principled metal under the same suns. "RMSE" is that of 16 samples
over the picture's mean, each sample clipped at a display's white, against many samples in which every lamp is
evaluated. "Mean" is the mean of 64 samples over that of those, without clipping. A material of the extension evaluates
every lamp up to three; from four on it evaluates two, unless the row says "every lamp".

With --flicker the tables give EEVEE's flicker instead, as in the benchmark footprint: the mesh turns by a tenth of a
degree between 24 frames.
"""

import argparse
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser

from . import report
from .footprint import flicker_of
from .render_time import Studio, Subject

_SAMPLES, _TIMED, _MEAN, _REFERENCE = 16, 32, 64, 256
_FLICKER_SAMPLES = (4, 16, 64)


def main(argv: list[str] | None = None) -> int:
    """Print the tables and return the exit status."""
    parser = OneLineParser(prog="./dev bench many_lamps", description=__doc__.splitlines()[0])
    parser.add_argument("--scene", action="append", choices=("sphere", "snake"))
    parser.add_argument("--lamps", type=count(1, 32), action="append", help="default: 1, 3, 8 and 32")
    parser.add_argument("--pixels", type=count(4, 8192), default=96)
    parser.add_argument("--repeat", type=count(1, 1000), default=3)
    parser.add_argument("--flicker", action="store_true", help="measure EEVEE's flicker instead")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    measured = _flickers if arguments.flicker else _measured
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        studio = Studio.started(Path(folder), arguments.pixels)
        for scene in arguments.scene or ("sphere", "snake"):
            studio.build(scene)
            for lamps in arguments.lamps or (1, 3, 8, 32):
                rows += measured(studio, scene, lamps, arguments)
    report.write({"rows": rows}, arguments.json)
    return 0


def _measured(studio: Studio, scene: str, lamps: int, arguments: argparse.Namespace) -> list[dict]:
    """Measure and print the rows of one number of suns."""
    report.say(f"{scene}, {lamps} suns", arguments.json)
    report.say(f"{'material':32}{'us':>8}{'to metal':>10}{'RMSE':>9}{'mean':>9}", arguments.json)
    made = {
        "Principled metal": studio.metal,
        "Lamps Only, every lamp": partial(studio.direct, every_lamp=True),
        "Lamps Only": studio.direct,
        "the same, footprint": partial(studio.direct, footprint=True),
        "the same, shadow rays": partial(studio.direct, shadows=True),
        "Lamps and World": partial(studio.direct, lights="REST"),
    }
    subjects = [Subject(name, make, lamps) for name, make in made.items()]
    us = 1e6 * studio.costs(subjects, _TIMED, arguments.repeat)
    noise = _noise(studio, subjects[1:3])
    rows = []
    for subject, cost in zip(subjects, us, strict=True):
        facts = {"scene": scene, "lamps": lamps, "material": subject.name, "us": float(cost)}
        facts |= {"to_metal": float(cost / us[0])} | noise.get(subject.name, {})
        told = "{rmse:9.4f}{mean:9.5f}".format(**noise[subject.name]) if subject.name in noise else ""
        report.say(f"{subject.name:32}{cost:8.3f}{cost / us[0]:10.2f}{told}", arguments.json)
        rows.append(facts)
    return rows


def _flickers(studio: Studio, scene: str, lamps: int, arguments: argparse.Namespace) -> list[dict]:
    """Measure and print the flicker under one number of suns."""
    report.say(f"{scene}, {lamps} suns", arguments.json)
    report.say(f"{'material':32}" + "".join(f"{samples:9}" for samples in _FLICKER_SAMPLES), arguments.json)
    rows = []
    for name, every_lamp in (("Lamps Only, every lamp", True), ("Lamps Only", False)):
        studio.show(Subject(name, partial(studio.direct, every_lamp=every_lamp), lamps))
        found = [flicker_of(studio, samples)[0] for samples in _FLICKER_SAMPLES]
        report.say(f"{name:32}" + "".join(f"{each:9.5f}" for each in found), arguments.json)
        told = dict(zip(map(str, _FLICKER_SAMPLES), found, strict=True))
        rows.append({"scene": scene, "lamps": lamps, "material": name, "flicker": told})
    return rows


def _noise(studio: Studio, subjects: list[Subject]) -> dict[str, dict]:
    """RMSE and mean of each subject by name, against the first one by many samples."""
    cycles = studio.scene.cycles

    def picture(subject: Subject, samples: int, *, clipped: bool, seed: int = 0) -> np.ndarray:
        studio.show(subject)
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = float(clipped)
        cycles.seed = seed
        rendered = studio.render("cycles", samples)[1]
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.seed = 0
        return rendered

    clipped = picture(subjects[0], _REFERENCE, clipped=True, seed=1)
    whole = picture(subjects[0], _MEAN, clipped=False)
    found = {}
    for subject in subjects:
        few = picture(subject, _SAMPLES, clipped=True)
        rmse = float(np.sqrt(np.mean((few - clipped) ** 2)) / clipped.mean())
        mean = float(picture(subject, _MEAN, clipped=False).mean() / whole.mean())
        found[subject.name] = {"rmse": rmse, "mean": mean}
    return found
