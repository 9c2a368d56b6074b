# SPDX-License-Identifier: GPL-3.0-or-later
"""What the footprint of a pixel does to noise in Cycles and to flicker in EEVEE, under one sun.

    python -m benchmarks footprint [--part noise --part flicker] [--scene snake|sphere] [--pixels 112]
        [--reference 8192] [--json FILE|-]

Noise: the RMSE of pictures, clipped at a display's white, against one of many samples without the footprint, over that
picture's mean; its light over that picture's; the processor's seconds; and the RMSE times the square root of these,
with the footprint over without. Flicker: the thing turns by a tenth of a degree between 24 frames; of their sums the
second differences, whose root mean square over the mean is the figure, since slow changes are no flicker.
"""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import report
from precompute.cli.option_types import count
from precompute.cli.parser import OneLineParser

from .render_time import Studio, Subject

SAMPLES = {"noise": (4, 16, 64, 256), "flicker": (4, 16)}
FRAMES, STEP_DEG = 24, 0.1


def noise(studio: Studio, group: Any, reference: int, json: str | None) -> list[dict]:
    """The rows of the noise's table."""
    studio.addon.skin.set_footprint(group, False)
    truth = studio.render("cycles", reference)[1]
    rows = []
    report.say(f"{'samples':>8}{'footprint':>11}{'RMSE':>8}{'light':>8}{'seconds':>9}{'at equal time':>15}", json)
    for samples in SAMPLES["noise"]:
        plain = None
        for counts in (False, True):
            studio.addon.skin.set_footprint(group, counts)
            studio.render("cycles", 1)  # compiles, and fills caches
            seconds, picture = studio.render("cycles", samples)
            rmse = float(np.sqrt(np.mean((picture.clip(0, 1) - truth.clip(0, 1)) ** 2)) / truth.clip(0, 1).mean())
            cost = rmse * seconds**0.5
            plain = plain or cost
            light = float(picture.mean() / truth.mean())
            rows.append({"samples": samples, "footprint": counts, "rmse": rmse, "light": light, "seconds": seconds})
            report.say(f"{samples:8}{counts!s:>11}{rmse:8.3f}{light:8.3f}{seconds:9.2f}{cost / plain:15.2f}", json)
    return rows


def flicker(studio: Studio, group: Any, json: str | None) -> list[dict]:
    """The rows of the flicker's table."""
    rows = []
    report.say(f"{'samples':>8}{'footprint':>11}{'flicker':>9}{'mean':>9}", json)
    for samples in SAMPLES["flicker"]:
        for counts in (False, True):
            studio.addon.skin.set_footprint(group, counts)
            sums = []
            for frame in range(FRAMES):
                studio.mesh.rotation_euler.z = np.radians(frame * STEP_DEG)
                sums.append(float(studio.render("eevee", samples)[1].mean()))
            found = float(np.sqrt(np.mean(np.diff(sums, 2) ** 2)) / np.mean(sums))
            rows.append({"samples": samples, "footprint": counts, "flicker": found, "mean": float(np.mean(sums))})
            report.say(f"{samples:8}{counts!s:>11}{found:9.4f}{np.mean(sums):9.4f}", json)
    return rows


def main(argv: list[str] | None = None) -> None:
    """Print the tables."""
    parser = OneLineParser(prog="benchmarks footprint", description=__doc__.splitlines()[0])
    parser.add_argument("--part", action="append", choices=tuple(SAMPLES), help="default: both")
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
            given = (arguments.reference,) if part == "noise" else ()
            facts[part] = {"noise": noise, "flicker": flicker}[part](studio, group, *given, arguments.json)
    report.write(facts, arguments.json)


if __name__ == "__main__":
    main()
