# SPDX-License-Identifier: GPL-3.0-or-later
"""The main job from end to end: `./dev demo`. It bakes a scan, lays it over a snake's skin, and renders it under suns.
The sample is also rendered under a sky, and its spectrum is thrown on a wall, with white light and with a laser.

Every step is a command that a user can type: `python -m precompute` for the bake and the map, and Blender in background
with `--command grating` to assign and render. A report of one page has the figures and the pictures."""

import json
import os
import platform
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from devtools import ROOT, blender
from devtools.environments import ALL, BPY45
from devtools.steps import clean_environment
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser


def write_report(output: Path, results: list[dict], seconds: dict[str, float], machine: str) -> Path:
    """Write report.md into `output` and return its path."""
    lines = ["# Natural Gratings: from scan to snake", "", f"Made by `./dev demo` on {machine}.", ""]
    for result in results:
        lines += section(output, result)
    lines += ["## Time", "", "| step | seconds |", "|---|---|"]
    lines += [f"| {step} | {value:.1f} |" for step, value in seconds.items()]
    path = output / "report.md"
    path.write_text("\n".join(lines) + "\n")
    return path


def section(output: Path, result: dict) -> list[str]:
    """The report's lines on one height map: measurements and pictures."""
    info, bake = result["info"], result["bake"]
    error = bake["delta_e"]
    dy, dx = info["pixel_size_m"]
    size = f"{info['cols'] * dx * 1e6:.1f} x {info['rows'] * dy * 1e6:.1f} um"
    period = f"{info['periods_m'][0] * 1e9:.0f} nm at {info['period_angles_deg'][0]:.1f} degrees"
    facts = {
        "Scan": f"{info['cols']} x {info['rows']} pixels, {size}",
        "Relief": f"{info['height_range_m'] * 1e9:.0f} nm, rms {info['height_rms_m'] * 1e9:.1f} nm",
        "Strongest period": period,
        "Coherence length": f"{bake['coherence_um']:.1f} um (at 550 nm)",
        "Table": f"{bake['tiles']} tiles of {bake['tile'][1]} x {bake['tile'][0]}, "
        f"{bake['blender_bytes'] / 2**20:.0f} MiB in Blender",
        "Colour error (dE00)": f"mean {error['mean']:.2f}, p95 {error['p95']:.2f}, p99 {error['p99']:.2f}, "
        f"max {error['max']:.2f} on {error['pairs']} direction pairs that the bake was not made from",
        "Energy error": f"sum of absolute dY over sum of Y: {error['relative_dy']:.2%}",
        "Bake": f"{bake['seconds']:.1f} s, self-check {bake['check_seconds']:.1f} s",
    }
    lines = [f"## {result['title']}", "", "| | |", "|---|---|"]
    lines += [f"| {name} | {value} |" for name, value in facts.items()]
    pictures = {"BRDF map, light at the normal": result["folder"] / "brdf_map.png", **result["pictures"]}
    for title, picture in pictures.items():
        relative = Path(os.path.relpath(picture, output)).as_posix()
        lines += ["", f"{title}:", "", f"![{title}]({relative})"]
    return [*lines, ""]


LASER = "532nm"
# Views of animal.py in the demo, and the number of faces of its snake.
VIEWS = {"snake": "hero", "sky": "sky"}
FACES = 120_000
SCANS = ROOT.parent / "shared" / "data" / "snake"


@dataclass(frozen=True)
class Subject:
    """A height map of the demo: title, FILE, options, folder for the results, the snake's species, and keys of
    PICTURES."""

    title: str
    file: str
    options: tuple[str, ...]
    folder: Path
    species: str
    pictures: tuple[str, ...] = ("snake",)


# The thesis's scans, both 65 um wide: title, file, height in nanometres from black to white, species.
REAL_SCANS = (
    ("Elaphe guttata, AFM scan", "elaphe_65um.png", "375", "ELAPHE"),
    ("Xenopeltis unicolor, AFM scan", "xenopeltis_65um.png", "818.69", "XENOPELTIS"),
)
# Each picture's title in the report, and its file.
PICTURES = {
    "snake": ("Cycles, under suns", "snake_cycles.png"),
    "sky": ("Cycles, under a clear sky", "snake_cycles_sky.png"),
    "wall": ("Cycles, its spectrum on a wall", "wall.png"),
    "laser": ("Cycles, a green laser's orders on the wall", "wall_laser.png"),
}


class Stopwatch:
    """Prints each step as it starts, and records how many seconds it took."""

    def __init__(self):
        self.seconds: dict[str, float] = {}

    def run(self, step: str, command: list, **settings) -> str:
        """Run a command and return its standard output. If it fails, exit with its status and the end of its output."""
        print(f"{step} ...", flush=True)
        start = time.monotonic()
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        process = subprocess.Popen([str(part) for part in command], cwd=ROOT, **pipes, **settings)
        try:
            out, err = process.communicate()
        except BaseException:  # a signal that ends the demo ends the step too
            process.terminate()
            process.wait()
            raise
        self.seconds[step] = time.monotonic() - start
        if process.returncode != 0:
            sys.stderr.write(out[-2000:] + err[-2000:])
            sys.exit(f"error: {step}: status {process.returncode}; the lines above tell why")
        print(f"{step}: {self.seconds[step]:.1f} s", flush=True)
        return out


def main(argv: list[str] | None = None) -> int:
    """Run the demo. Returns the exit status."""
    parser = OneLineParser(prog="./dev demo", description=__doc__)
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--bpy", choices=[e.blender_version for e in ALL], help="the bpy wheel to render with")
    parser.add_argument("--blender", type=Path, help="the Blender binary to render with")
    parser.add_argument("--samples", type=count(1, 1 << 20), default=12, help="Cycles samples a pixel; default 12")
    parser.add_argument("--width", type=count(4, 8192), default=480)
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


def subjects(output: Path, scans: Path = SCANS) -> list[Subject]:
    """The shipped sample, and each real scan that is in the folder `scans`."""
    found = [Subject("Elaphe-like sample", "sample:elaphe", (), output, "ELAPHE", tuple(PICTURES))]
    for title, name, height_nm, species in REAL_SCANS:
        file = scans / name
        if file.is_file():
            options = ("--size-um", "65", "--height-nm", height_nm)
            found.append(Subject(title, str(file), options, output / file.stem, species))
        else:
            print(f"no {name} in ../shared/data/snake: without {title}", flush=True)
    return found


def run_subject(subject: Subject, arguments, watch: Stopwatch) -> dict:
    """Bake, map and render one height map. Returns the facts for the report."""
    folder, name = subject.folder, subject.title
    precompute = [sys.executable, "-m", "precompute"]
    height_map = [subject.file, *subject.options]
    info = watch.run(f"{name}: info", [*precompute, "info", *height_map, "--json", "-"])
    bake = json.loads(watch.run(f"{name}: bake", [*precompute, "bake", *height_map, "-o", folder, "--json", "-"]))
    baked = Path(bake["files"][0])
    watch.run(f"{name}: map", [*precompute, "map", baked, "-o", folder / "brdf_map.png"])
    pictures = {}
    for kind in subject.pictures:
        title, file = PICTURES[kind]
        pictures[title] = folder / file
        if kind in VIEWS:
            render_snake(f"{name}: {kind}", baked, (VIEWS[kind], subject.species), folder / file, arguments, watch)
            continue
        if kind == "laser":
            laser = [*precompute, "bake", *height_map, "--illuminant", LASER, "-o", folder / "laser", "--json", "-"]
            baked = json.loads(watch.run(f"{name}: bake for a laser", laser))["files"][0]
        render_wall(f"{name}: {kind}", baked, folder / file, arguments=arguments, watch=watch)
    return {"title": name, "info": json.loads(info), "bake": bake, "folder": folder, "pictures": pictures}


def render_snake(
    step: str, baked: Path, look: tuple[str, str], picture: Path, arguments, watch: Stopwatch
) -> None:  # fmt: skip
    """Build the scene of a snake, lay the bake over its skin, and render. `look` is the view and the species."""
    view, species = look
    stage = ["animal.py", "--view", view, "--species", species, "--faces", FACES]
    edits = (["assign", baked, "--object", "Snake", "--over"],)
    render_scene(step, picture, [stage], edits=edits, samples=arguments.samples, arguments=arguments, watch=watch)


def render_wall(step: str, baked: Path, picture: Path, *, arguments, watch: Stopwatch) -> None:
    """Build the scene of a grating before a wall, assign the bake, add a Diffraction Lamp, and render. The spectrum is
    noise-free, so an eighth of the samples is enough."""
    edits = (["assign", baked, "--object", "Carrier", "--lights", "lamps"], ["diffraction-lamp", "--object", "Carrier"])
    samples = max(1, arguments.samples // 8)
    render_scene(step, picture, [["wall.py"]], edits=edits, samples=samples, arguments=arguments, watch=watch)


def render_scene(
    step: str,
    picture: Path,
    stages: Sequence[list],
    *,
    edits: Sequence[list],
    samples: int,
    arguments,
    watch: Stopwatch,
) -> None:
    """Write a scene, edit it and render it, each step by a run of Blender in background.

    `stages` are scripts of sample_scenes with their arguments; `edits` are verbs of the command line with theirs.
    `arguments` gives the picture's width, the Blender to use, and the engine (by default Cycles)."""
    scene = picture.with_suffix(".blend")
    commands = []
    for script, *options in stages:
        opened = [scene] if commands else []
        make = ["--background", "--python-exit-code", "1", "--python", ROOT / "sample_scenes" / script]
        commands.append((Path(script).stem, [*opened, *make, "--", "--output", scene, *options]))
    size = ["--width", arguments.width, "--height", arguments.width * 9 // 16]
    engine = getattr(arguments, "engine", "cycles")
    render = ["render", "-o", picture, "--engine", engine, "--samples", samples, *size]
    for verb in (*edits, render):
        commands.append((verb[0], ["--background", scene, "--command", "grating", *verb]))
    for what, command in commands:
        launch = start_blender(arguments, [str(part) for part in command])
        watch.run(f"{step}, {what}", launch.command, env=clean_environment(**launch.variables))
    scene.with_suffix(".blend1").unlink(missing_ok=True)


def start_blender(arguments, command: list[str]) -> blender.Launch:
    """How to start Blender: as asked for, else a Blender binary if there is one, else the bpy wheel."""
    binary = arguments.blender or (None if arguments.bpy else blender.find_binary())
    if binary:
        return blender.launch_binary(binary, command)
    environment = next((e for e in ALL if e.blender_version == arguments.bpy), BPY45)
    return blender.launch_shim(environment, command)


def stop(number: int, _: object) -> NoReturn:
    """End the demo and its running step after a signal."""
    sys.exit(128 + number)


if __name__ == "__main__":
    for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(each, stop)
    sys.exit(main())
