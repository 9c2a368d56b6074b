# SPDX-License-Identifier: GPL-3.0-or-later
"""The main job from end to end: `./dev demo`. A scan is baked, assigned to a snake, and rendered under two suns.

Every step is a command that a user can type: `python -m precompute` for the bake and the map, and Blender in background
with `--command grating` to assign and render. This file only joins them.
"""

import json
import platform
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from devtools import ROOT, blender
from devtools.environments import ALL, PY311
from devtools.steps import clean_environment
from precompute.cli.option_types import count
from precompute.cli.parser import OneLineParser
from sample_scenes.report import write_report

# From the second sun the colours run the other way along the body (sample_scenes/stage.py).
SUN_AZIMUTHS_DEG = (128, 52)
ELAPHE_SCAN = ROOT.parent / "shared" / "data" / "snake" / "elaphe_65um.png"


@dataclass(frozen=True)
class Subject:
    """A height map of the demo: its title, FILE and options for the command line, and the folder of its results."""

    title: str
    file: str
    options: tuple[str, ...]
    folder: Path


class Stopwatch:
    """Prints each step as it starts, and keeps how many seconds it took."""

    def __init__(self):
        self.seconds: dict[str, float] = {}

    def run(self, step: str, command: list, **settings) -> str:
        """Run a command; its standard output. Exits with its status and the end of its output if it fails."""
        print(f"{step} ...", flush=True)
        start = time.monotonic()
        done = subprocess.run([str(part) for part in command], capture_output=True, text=True, cwd=ROOT, **settings)
        self.seconds[step] = time.monotonic() - start
        if done.returncode != 0:
            sys.stderr.write(done.stdout[-2000:] + done.stderr[-2000:])
            sys.exit(f"error: {step}: status {done.returncode}; the lines above tell why")
        print(f"{step}: {self.seconds[step]:.1f} s", flush=True)
        return done.stdout


def main(argv: list[str] | None = None) -> int:
    """Run the demo; the exit status."""
    parser = OneLineParser(prog="./dev demo", description=__doc__)
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--bpy", choices=[e.blender_version for e in ALL], help="the bpy wheel to render with")
    parser.add_argument("--blender", type=Path, help="the Blender binary to render with")
    parser.add_argument("--samples", type=count(1, 1 << 20), default=32, help="Cycles samples a pixel; default 32")
    parser.add_argument("--width", type=count(4, 8192), default=960)
    arguments = parser.parse_args(argv)
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    watch = Stopwatch()
    results = []
    for subject in subjects(output):
        subject.folder.mkdir(parents=True, exist_ok=True)
        results.append(run_subject(subject, arguments, watch))
    report = write_report(output, results, watch.seconds, platform.platform())
    print(report)
    return 0


def subjects(output: Path) -> list[Subject]:
    """The shipped sample, and the real scan where its file is present."""
    found = [Subject("Elaphe-like sample", "sample:elaphe", (), output)]
    if ELAPHE_SCAN.is_file():
        options = ("--size-um", "65", "--height-nm", "375")
        found.append(Subject("Elaphe guttata, AFM scan", str(ELAPHE_SCAN), options, output / "elaphe_65um"))
    else:
        print(f"no {ELAPHE_SCAN.name} in ../shared/data/snake: the sample alone", flush=True)
    return found


def run_subject(subject: Subject, arguments, watch: Stopwatch) -> dict:
    """Bake, map and render one height map; the facts for the report."""
    folder, name = subject.folder, subject.title
    precompute = [sys.executable, "-m", "precompute"]
    height_map = [subject.file, *subject.options]
    info = watch.run(f"{name}: info", [*precompute, "info", *height_map, "--json", "-"])
    bake = json.loads(watch.run(f"{name}: bake", [*precompute, "bake", *height_map, "-o", folder, "--json", "-"]))
    baked = Path(bake["files"][0])
    watch.run(f"{name}: map", [*precompute, "map", baked, "-o", folder / "brdf_map.png"])
    pictures = []
    for number, azimuth in enumerate(SUN_AZIMUTHS_DEG):
        picture = folder / ("snake_cycles.png" if number == 0 else f"snake_cycles_sun_{azimuth}.png")
        render_snake(f"{name}: sun at {azimuth} degrees", baked, azimuth, picture, arguments, watch)
        pictures.append(picture)
    return {"title": name, "info": json.loads(info), "bake": bake, "folder": folder, "pictures": pictures}


def render_snake(step: str, baked: Path, azimuth: int, picture: Path, arguments, watch: Stopwatch) -> None:
    """Build the stage, assign the bake to the snake, render: three runs of Blender in background."""
    scene = picture.with_suffix(".blend")
    stage = ["--background", "--python-exit-code", "1", "--python", ROOT / "sample_scenes" / "stage.py"]
    stage += ["--", "--output", scene, "--sun-azimuth-deg", azimuth]
    assign = ["--background", scene, "--command", "grating", "assign", baked, "--object", "Snake"]
    render = ["--background", scene, "--command", "grating", "render", "-o", picture, "--engine", "cycles"]
    render += ["--samples", arguments.samples, "--width", arguments.width, "--height", arguments.width * 9 // 16]
    for what, command in (("scene", stage), ("assign", assign), ("render", render)):
        launch = start_blender(arguments, [str(part) for part in command])
        watch.run(f"{step}, {what}", launch.command, env=clean_environment(**launch.variables))
    scene.with_suffix(".blend1").unlink(missing_ok=True)


def start_blender(arguments, command: list[str]) -> blender.Launch:
    """How to start Blender: the one that was asked for, else a binary if there is one, else the bpy wheel."""
    binary = arguments.blender or (None if arguments.bpy else blender.find_binary())
    if binary:
        return blender.launch_binary(binary, command)
    environment = next((e for e in ALL if e.blender_version == arguments.bpy), PY311)
    return blender.launch_shim(environment, command)


if __name__ == "__main__":
    sys.exit(main())
