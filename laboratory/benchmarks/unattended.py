# SPDX-License-Identifier: GPL-3.0-or-later
"""What a farm asks: does one process render a thousand frames in constant memory, and do files look the same without
the extension?

    ./dev bench unattended --part frames [--frames 1000] [--engine cycles|eevee] [--json FILE|-]
    ./dev bench unattended --part scenes --scenes DIR [--json FILE|-]

`frames` renders a sphere with a grating under a sun that turns, as a job's worker does, and gives the memory of the
process after a tenth of the frames, when Blender's caches are full, and after all. `scenes` renders each .blend of a
folder, such as that of `./dev scenes`, three times: with the extension, with it and auto-run off, and in an empty
profile without it. It counts the pixels that differ."""

import argparse
import os
import subprocess
import sys
import tempfile
from math import radians
from pathlib import Path

import numpy as np
from PIL import Image

from devtools.blender import SHIM
from devtools.extension import link_extension
from devtools.steps import clean_environment
from precompute.cli.arguments import count, path_argument
from precompute.cli.parser import OneLineParser
from precompute.render_job.plan import SCENES, Picture, plan_of, write_record

from . import report
from .render_time import Studio, Subject

_SMALL = """
import bpy
scene = bpy.context.scene
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 54, 100
scene.cycles.samples = scene.eevee.taa_render_samples = 4
"""
_COMPARE_FRAME = 1


def main(argv: list[str] | None = None) -> int:
    """Print the tables and return the exit status."""
    parser = OneLineParser(prog="./dev bench unattended", description=__doc__.splitlines()[0])
    parser.add_argument("--part", choices=("frames", "scenes"), required=True)
    parser.add_argument("--frames", type=count(20, 1_000_000), default=1000)
    parser.add_argument("--engine", choices=("cycles", "eevee"), default="cycles")
    parser.add_argument("--scenes", type=path_argument, metavar="DIR", help="the folder of .blend files")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        part = many_frames if arguments.part == "frames" else same_scenes
        facts = part(Path(folder), arguments)
    report.write(facts, arguments.json)
    return 0


def many_frames(folder: Path, arguments: argparse.Namespace) -> dict:
    """Render the frames in this process. Returns the resident memory in MiB at the frames where it was read."""
    studio = Studio.started(folder, 16)
    import bpy  # after the start, which sets Blender's folders

    studio.build("sphere")
    studio.show(Subject("Direct, 1 sun", studio.direct))
    lamp = next(thing for thing in bpy.data.objects if thing.type == "LIGHT")
    for frame, angle in ((1, 0), (arguments.frames, 360)):
        lamp.rotation_euler.z = radians(angle)
        lamp.keyframe_insert("rotation_euler", frame=frame)
    plan = folder / SCENES / "sphere.json"
    plan.parent.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(plan.with_suffix(".blend")))
    pictures = [_frame(frame, arguments.engine) for frame in range(1, arguments.frames + 1)]
    made_by = {"natural_gratings": "benchmark", "request": None}
    write_record(plan, plan_of("sphere.blend", "benchmark", pictures, made_by=made_by))
    memory: dict[int, float] = {}
    step = max(1, arguments.frames // 10)

    def tell(_: str, done: int, total: int) -> None:
        if done % step == 0 or done == total:
            memory[done] = resident_mib()
            report.say(f"frame {done:6}: {memory[done]:7.1f} MiB", arguments.json)

    outcome = studio.addon.worker.render_plan(plan, tell=tell)
    first, last = memory[step], memory[arguments.frames]
    report.say(f"{outcome}; {last / first - 1:+.1%} from frame {step} to {arguments.frames}", arguments.json)
    return {"memory_mib": memory, "change": last / first - 1, "failed": outcome.failed}


def _frame(frame: int, engine: str) -> Picture:
    return Picture(f"{frame:06d}", None, None, (), engine, None, frame, 1, False, 16, 16)


def resident_mib() -> float:
    """The resident memory of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def same_scenes(folder: Path, arguments: argparse.Namespace) -> dict:
    """Render each scene three times. Returns for each the share of pixels that differ from those with the extension."""
    rows = []
    for path in sorted(arguments.scenes.glob("*.blend")):
        with_it = _rendered(path, folder / "with", [], factory=False)
        off = _rendered(path, folder / "off", ["-Y"], factory=False)
        without = _rendered(path, folder / "without", ["-Y"], factory=True)
        rows.append({"scene": path.stem, "auto_run_off": _differ(with_it, off), "without": _differ(with_it, without)})
        report.say(
            "{scene:24} auto-run off {auto_run_off:.2%}, without {without:.2%}".format(**rows[-1]), arguments.json
        )
    return {"rows": rows}


def _rendered(path: Path, output: Path, options: list[str], *, factory: bool) -> Path:
    """Render a scene small, in a process of its own. Returns the picture."""
    words = ["--background", *(["--factory-startup"] if factory else []), *options]
    # With one thread, because Cycles rounds a few pixels differently from run to run with several.
    shot = ["--threads", "1", "--python-expr", _SMALL, "-o", f"{output}_", "-F", "PNG", "-f", str(_COMPARE_FRAME)]
    profile = output.parent / ("empty" if factory else "profile")
    if not factory:
        link_extension(profile)
    environment = clean_environment(BLENDER_USER_RESOURCES=str(profile))
    command = [sys.executable, "-P", str(SHIM), *words, str(path.resolve()), *shot]
    subprocess.run(command, env=environment, check=True, capture_output=True)
    return Path(f"{output}_{_COMPARE_FRAME:04d}.png")


def _differ(one: Path, other: Path) -> float:
    """The share of pixels that differ in 8 bits."""
    a, b = (np.asarray(Image.open(path).convert("RGB")) for path in (one, other))
    return float((a != b).any(axis=-1).mean())
