# SPDX-License-Identifier: GPL-3.0-or-later
"""The main job from end to end: `./dev demo`. It bakes a scan, lays it over a snake's skin, and renders it under suns.
The spectrum of the scan is thrown on a wall, with white light and with a laser. Without the real scan's file, the
sample that imitates it takes its place.

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
from pathlib import Path
from typing import NoReturn

from devtools import ROOT, blender
from devtools.environments import ALL, BPY45
from devtools.steps import clean_environment
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser


def write_report(output: Path, result: dict, seconds: dict[str, float], machine: str) -> Path:
    """Write report.md into `output` and return its path."""
    lines = ["# Natural Gratings: from scan to snake", "", f"Made by `./dev demo` on {machine}.", ""]
    lines += [*section(output, result), "## Time", "", "| step | seconds |", "|---|---|"]
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
FACES = 120_000
SCANS = ROOT.parent / "shared" / "data" / "snake"
# The thesis's scans, both 65 um wide: file, and height in nanometres from black to white.
REAL_SCANS = {"elaphe": ("elaphe_65um.png", "375"), "xenopeltis": ("xenopeltis_65um.png", "818.69")}
# Each picture's title in the report, and its file.
PICTURES = {
    "snake": ("Cycles, under suns", "snake_cycles.png"),
    "wall": ("Cycles, its spectrum on a wall", "wall.png"),
    "laser": ("Cycles, a green laser's orders on the wall", "wall_laser.png"),
}


def scan_or_sample(name: str, scans: Path = SCANS) -> list[str]:
    """FILE and options of the real scan of a species if it is in the folder `scans`, else the sample like it."""
    file, height_nm = REAL_SCANS.get(name, ("", ""))
    if file and (scans / file).is_file():
        return [str(scans / file), "--size-um", "65", "--height-nm", height_nm]
    return [f"sample:{name}"]


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
    parser.add_argument("--samples", type=count(1, 1 << 20), default=8, help="Cycles samples a pixel; default 8")
    parser.add_argument("--width", type=count(4, 8192), default=480)
    arguments = parser.parse_args(argv)
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    watch = Stopwatch()
    result = run(output, arguments, watch)
    print(write_report(output, result, watch.seconds, platform.platform()))
    return 0


def run(output: Path, arguments, watch: Stopwatch) -> dict:
    """Bake, map and render a corn snake's scan. Returns the facts for the report."""
    precompute = [sys.executable, "-m", "precompute"]
    height_map = scan_or_sample("elaphe")
    info = json.loads(watch.run("info", [*precompute, "info", *height_map, "--json", "-"]))
    bake = json.loads(watch.run("bake", [*precompute, "bake", *height_map, "-o", output, "--json", "-"]))
    baked = bake["files"][0]
    watch.run("map", [*precompute, "map", baked, "-o", output / "brdf_map.png"])
    laser = [*precompute, "bake", *height_map, "--illuminant", LASER, "-o", output / "laser", "--json", "-"]
    by_laser = json.loads(watch.run("bake for a laser", laser))["files"][0]
    given = {"samples": arguments.samples, "arguments": arguments, "watch": watch}
    files = {name: output / file for name, (_, file) in PICTURES.items()}
    stage = ["animal.py", "--species", "ELAPHE", "--faces", FACES]
    over = (["assign", baked, "--object", "Snake", "--over"],)
    render_scene("snake", files["snake"], [stage], edits=over, **given)
    for name, file in (("wall", baked), ("laser", by_laser)):
        assign = ["assign", file, "--object", "Carrier", "--lights", "lamps"]
        edits = (assign, ["diffraction-lamp", "--object", "Carrier"])
        render_scene(name, files[name], [["wall.py"]], edits=edits, **given)
    pictures = {title: files[name] for name, (title, _) in PICTURES.items()}
    return {"title": Path(height_map[0]).name, "info": info, "bake": bake, "folder": output, "pictures": pictures}


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
