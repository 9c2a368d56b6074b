# SPDX-License-Identifier: GPL-3.0-or-later
"""How the pixel footprint changes noise in Cycles and flicker in EEVEE, under one sun.

    ./dev bench footprint [--part noise|denoiser|close|flicker ...] [--scene snake|sphere] [--pixels 112]
        [--reference 8192] [--json FILE|-]

Noise: the RMSE of a picture, clipped at display white, against a picture of many samples without the footprint,
relative to the mean of that picture. The table also gives the ratio of the two pictures' light, the processor seconds,
and the RMSE times the square root of the seconds, with the footprint relative to without.
Flicker: the mesh turns by a tenth of a degree between 24 frames. The figure is the root mean square of the second
differences of the frames' mean light, relative to its mean: second differences ignore slow changes.
Denoiser: Cycles' own (OpenImageDenoise), with no passes, with albedo, or with albedo and normal. The table gives the
RMSE as above, and over the lit pixels the CIEDE2000 to the reference and the chroma relative to the reference's.
Close: a close-up of single scales, where the footprint should change nothing. The table gives the CIEDE2000 between
pictures with and without it, at the same random numbers.
"""

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser

from . import report
from .osl import colour_differences
from .render_time import Studio, Subject

SAMPLES = {"noise": (4, 16, 64, 256), "denoiser": (16, 64), "close": (64,), "flicker": (4, 16)}
PASSES = {"no denoiser": None, "colour alone": "RGB", "albedo": "RGB_ALBEDO", "albedo, normal": "RGB_ALBEDO_NORMAL"}
# The factor on the focal length in the part "close".
_CLOSER = 12
FRAMES, STEP_DEG = 24, 0.1


def noise(studio: Studio, group: Any, arguments: argparse.Namespace) -> list[dict]:
    """Measure the rows of the noise table."""
    truth = reference(studio, group, arguments.reference)
    rows = []
    head = f"{'samples':>8}{'footprint':>11}{'RMSE':>8}{'light':>8}{'seconds':>9}{'at equal time':>15}"
    report.say(head, arguments.json)
    for samples in SAMPLES["noise"]:
        plain = None
        for counts in (False, True):
            studio.addon.skin.set_up(group, footprint=counts)
            studio.render("cycles", 1)  # compiles the shaders and fills the caches
            seconds, picture = studio.render("cycles", samples)
            rmse = rmse_of(picture, truth)
            cost = rmse * seconds**0.5
            plain = plain or cost
            light = float(picture.mean() / truth.mean())
            rows.append({"samples": samples, "footprint": counts, "rmse": rmse, "light": light, "seconds": seconds})
            line = f"{samples:8}{counts!s:>11}{rmse:8.3f}{light:8.3f}{seconds:9.2f}{cost / plain:15.2f}"
            report.say(line, arguments.json)
    return rows


def denoiser(studio: Studio, group: Any, arguments: argparse.Namespace) -> list[dict]:
    """Measure the rows of the denoiser table."""
    truth = reference(studio, group, arguments.reference)
    rows = []
    head = f"{'samples':>8}{'footprint':>11}  {'passes':16}{'RMSE':>8}{'dE00':>7}{'p95':>7}{'chroma':>8}{'seconds':>9}"
    report.say(head, arguments.json)
    cycles = studio.scene.cycles
    for samples in SAMPLES["denoiser"]:
        for counts in (False, True):
            studio.addon.skin.set_up(group, footprint=counts)
            for name, passes in PASSES.items():
                cycles.use_denoising = passes is not None
                if passes:
                    cycles.denoiser, cycles.denoising_input_passes = "OPENIMAGEDENOISE", passes
                studio.render("cycles", 1)
                seconds, picture = studio.render("cycles", samples)
                p50, p95 = np.percentile(colour_differences(picture, truth), [50, 95])
                row = {"samples": samples, "footprint": counts, "passes": name, "rmse": rmse_of(picture, truth)}
                row |= {"p50": p50, "p95": p95, "chroma": chroma(picture) / chroma(truth), "seconds": seconds}
                rows.append(row)
                line = f"{samples:8}{counts!s:>11}  {name:16}{row['rmse']:8.3f}{p50:7.2f}{p95:7.2f}{row['chroma']:8.3f}"
                report.say(f"{line}{seconds:9.2f}", arguments.json)
    cycles.use_denoising = False
    return rows


def close(studio: Studio, group: Any, arguments: argparse.Namespace) -> list[dict]:
    """Measure the rows of the close-up table."""
    camera, rows = studio.scene.camera.data, []
    camera.lens *= _CLOSER
    for samples in SAMPLES["close"]:
        pictures = []
        for counts in (False, True):
            studio.addon.skin.set_up(group, footprint=counts)
            pictures.append(studio.render("cycles", samples)[1])
        p50, p95 = np.percentile(colour_differences(pictures[1], pictures[0]), [50, 95])
        light = float(pictures[1].mean() / pictures[0].mean())
        rows.append({"samples": samples, "p50": p50, "p95": p95, "light": light})
        report.say(f"close by, {samples} samples: dE00 {p50:.2f}, p95 {p95:.2f}, light {light:.3f}", arguments.json)
    camera.lens /= _CLOSER
    return rows


def reference(studio: Studio, group: Any, samples: int) -> np.ndarray:
    """Render the reference picture: many samples, without the footprint."""
    studio.addon.skin.set_up(group, footprint=False)
    return studio.render("cycles", samples)[1]


def rmse_of(picture: np.ndarray, truth: np.ndarray) -> float:
    """The RMSE of a picture against the truth, both clipped at display white, relative to the truth's mean."""
    picture, truth = picture.clip(0, 1), truth.clip(0, 1)
    return float(np.sqrt(np.mean((picture - truth) ** 2)) / truth.mean())


def chroma(picture: np.ndarray) -> float:
    """The mean difference between the largest and smallest channel of a linear picture, relative to its mean."""
    picture = picture.clip(0, 1)
    return float((picture.max(axis=-1) - picture.min(axis=-1)).mean() / picture.mean())


def flicker(studio: Studio, group: Any, arguments: argparse.Namespace) -> list[dict]:
    """Measure the rows of the flicker table."""
    rows = []
    report.say(f"{'samples':>8}{'footprint':>11}{'flicker':>9}{'mean':>9}", arguments.json)
    for samples in SAMPLES["flicker"]:
        for counts in (False, True):
            studio.addon.skin.set_up(group, footprint=counts)
            found, mean = flicker_of(studio, samples)
            rows.append({"samples": samples, "footprint": counts, "flicker": found, "mean": mean})
            report.say(f"{samples:8}{counts!s:>11}{found:9.4f}{mean:9.4f}", arguments.json)
    return rows


def flicker_of(studio: Studio, samples: int) -> tuple[float, float]:
    """The flicker of the turning mesh in EEVEE, relative to its mean light, and this mean."""
    sums = []
    for frame in range(FRAMES):
        studio.mesh.rotation_euler.z = np.radians(frame * STEP_DEG)
        sums.append(float(studio.render("eevee", samples)[1].mean()))
    mean = float(np.mean(sums))
    return float(np.sqrt(np.mean(np.diff(sums, 2) ** 2))) / mean, mean


PARTS = {"noise": noise, "denoiser": denoiser, "close": close, "flicker": flicker}


def main(argv: list[str] | None = None) -> None:
    """Print the tables."""
    parser = OneLineParser(prog="./dev bench footprint", description=__doc__.splitlines()[0])
    parser.add_argument("--part", action="append", choices=tuple(SAMPLES), help="default: all")
    parser.add_argument("--scene", choices=("snake", "sphere"), default="snake", help="default: the sample snake")
    parser.add_argument("--pixels", type=count(4, 8192), default=112)
    parser.add_argument("--reference", type=count(16, 1 << 20), default=8192, help="samples of the picture to compare")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    facts = {}
    with tempfile.TemporaryDirectory() as folder:
        studio = Studio.started(Path(folder), arguments.pixels)
        studio.build(arguments.scene)
        studio.show(Subject("direct", studio.direct))
        group = next(node.node_tree for node in studio.addon.material.diffraction_nodes(studio.mesh.active_material))
        for part in arguments.part or SAMPLES:
            facts[part] = PARTS[part](studio, group, arguments)
    report.write(facts, arguments.json)


if __name__ == "__main__":
    main()
