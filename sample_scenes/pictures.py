# SPDX-License-Identifier: GPL-3.0-or-later
"""A sheet of pictures for each species: the snake at three zooms under three suns (thesis figures 6.14 to 6.18).

python -m sample_scenes.pictures --output DIR [--bpy 5.2] [--samples 16 --width 480]

The sheets use the real scans if their files are present, else the shipped samples that imitate them."""

import json
import sys
from pathlib import Path

from PIL import Image

from devtools import ROOT
from devtools.environments import ALL
from devtools.steps import clean_environment
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from sample_scenes.demo import Stopwatch, start_blender, subjects
from sample_scenes.sheet import join

ZOOMS, AZIMUTHS = ("whole", "bends", "scales"), (128, 90, 52)


def main(argv: list[str] | None = None) -> int:
    """Bake, assign and render both species, and write their sheets. Returns the exit status."""
    parser = OneLineParser(prog="sample_scenes.pictures", description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--bpy", choices=[e.blender_version for e in ALL], help="the bpy wheel to render with")
    parser.add_argument("--samples", type=count(1, 1 << 20), default=16)
    parser.add_argument("--width", type=count(4, 8192), default=480)
    arguments = parser.parse_args(argv)
    arguments.blender = None
    found = {subject.folder.name: [subject.file, *subject.options] for subject in subjects(arguments.output)}
    for name in ("elaphe", "xenopeltis"):
        sheet(name, found.get(f"{name}_65um", [f"sample:{name}"]), arguments)
    return 0


def sheet(name: str, height_map: list, arguments) -> None:
    """The sheet of one species: a row for each zoom, a column for each sun."""
    watch = Stopwatch()
    folder = arguments.output.resolve() / name
    folder.mkdir(parents=True, exist_ok=True)
    bake = [sys.executable, "-m", "precompute", "bake", *height_map, "-o", folder, "--json", "-"]
    baked = json.loads(watch.run(f"{name}: bake", bake))["files"][0]
    scene = folder / "snake.blend"
    stage = ["--species", name.upper(), "--set", "turntable"]
    script = ["--background", "--python-exit-code", "1", "--python"]
    views = [scene, *script, ROOT / "sample_scenes" / "views.py", "--", "--output", folder]
    steps = {
        "scene": [*script, ROOT / "sample_scenes" / "animal.py", "--", "--output", scene, *stage],
        "assign": [scene, "--background", "--command", "grating", "assign", baked, "--object", "Snake", "--over"],
        "views": [*views, "--samples", arguments.samples, "--width", arguments.width],
    }
    for step, command in steps.items():
        launch = start_blender(arguments, [str(part) for part in command])
        watch.run(f"{name}: {step}", launch.command, env=clean_environment(**launch.variables))
    tiles = [
        (f"{zoom}, sun at {azimuth}", Image.open(folder / f"{zoom}_{azimuth}.png").convert("RGB"))
        for zoom in ZOOMS
        for azimuth in AZIMUTHS
    ]
    join(tiles, len(AZIMUTHS)).save(arguments.output / f"snake_{name}.jpg", quality=86, optimize=True)


if __name__ == "__main__":
    sys.exit(main())
