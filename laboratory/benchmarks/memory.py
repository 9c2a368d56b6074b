# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory and time that parts of the project take for pictures of different sizes, compared with the expected figures.

    ./dev bench memory [--json FILE|-]

A separate child process measures each row. These measurements give the constants of precompute/bake/plan.py, and
the bytes per pixel in surface/readers/pictures.py, surface/relief.py, spectra/spectrum.py and methods/term_images.py.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from precompute.bake import ensemble, plan
from precompute.bake.make import make, peak_bytes
from precompute.bake.request import BakeRequest
from precompute.base import machine
from precompute.cli.parser import OneLineParser
from precompute.methods import method_registry
from precompute.methods.method import Settings
from precompute.reference.reference import reference_grid
from precompute.spectra.spectrum import scattered_spectrum
from precompute.surface.quality import describe
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import Relief, prepare

from . import report

# Each row: the work, the picture's side in pixels, its width in micrometres and its height in nanometres.
ROWS = (
    ("read", 4000, 100, 300), ("describe", 1000, 65, 300), ("describe", 4000, 200, 300),
    ("prepare", 512, 250, 300), ("prepare", 1024, 500, 300),
    ("transform", 512, 60, 300), ("transform", 512, 120, 300),
    ("flss", 512, 60, 300), ("flss", 512, 120, 300), ("chebyshev", 512, 120, 1200),
    ("bake", 512, 40, 300), ("bake", 1024, 65, 300), ("bake", 512, 150, 300), ("bake", 256, 20, 5000),
)  # fmt: skip


def write_scan(file: Path, side: int, width_um: float) -> None:
    """Write a grey picture of eight waves, along each axis at least 1.5 um and four pixels long."""
    rng = np.random.default_rng(0)
    x = np.arange(side) * width_um / side
    finest = max(1.5, 4 * width_um / side)
    waves = (
        np.sin(2 * np.pi * (x * a + x[:, None] * b) / finest + k) for k, (a, b) in enumerate(rng.uniform(-1, 1, (8, 2)))
    )
    heights = sum(waves)
    heights -= heights.min()
    Image.fromarray(np.round(heights / heights.max() * 65535).astype(np.uint16)).save(file)


def transform(relief: Relief) -> None:
    """One exact transform of a relief, as for the reference."""
    scattered_spectrum(relief, 2e6, reference_grid(relief, 0.01))


def measure(what: str, file: Path, width_um: float, height_nm: float) -> dict[str, float]:
    """Measure one piece of work in this process: bytes beyond those before it, seconds, and the expected figures."""
    told: list[float] = []

    def note(needed: float, what: str, remedy: str, **_: object) -> None:
        told.append(needed)

    for module in [module for name, module in sys.modules.items() if name.startswith("precompute.")]:
        if hasattr(module, "refuse_beyond_memory"):
            module.refuse_beyond_memory = note
    seconds_told = [0.0]

    def tell(work, wavelengths, *, scans, progress) -> None:
        told.append(plan.expected_bytes(work))
        seconds_told.append(plan.expected_seconds(work, wavelengths))

    ensemble.tell = tell
    before = peak_bytes()
    start = time.perf_counter()
    height_map = read_height_map(str(file), width_um, height_nm)
    if what != "read":
        told.clear()
        start, before = time.perf_counter(), peak_bytes()
        if what == "describe":
            describe(height_map)
        else:
            relief = prepare(height_map)
            works: dict[str, Callable[[], object]] = {
                "prepare": lambda: None,
                "transform": lambda: transform(relief),
                "bake": lambda: make([relief], BakeRequest()),
            }
            works.get(what, lambda: method_registry.METHODS[what](relief, Settings()))()
    return {
        "expected_bytes": max(told, default=0.0),
        "bytes": peak_bytes() - before,
        "expected_seconds": max(seconds_told),
        "seconds": time.perf_counter() - start,
    }


def main(argv: list[str]) -> None:
    """Measure every row and print the table."""
    parser = OneLineParser(prog="./dev bench memory", description=__doc__.splitlines()[0])
    parser.add_argument("--one", nargs=4, metavar=("WHAT", "FILE", "UM", "NM"), help=argparse.SUPPRESS)
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    if arguments.one:
        what, file, width_um, height_nm = arguments.one
        print(json.dumps(measure(what, Path(file), float(width_um), float(height_nm))))
        return
    rows = []
    report.say(
        f"{'':<10} {'pixels':>7} {'um':>5} {'nm':>5}  {'expected':>9} {'taken':>9}  {'expected':>8} {'taken':>6}",
        arguments.json,
    )
    with tempfile.TemporaryDirectory() as folder:
        for what, side, width_um, height_nm in ROWS:
            file = Path(folder) / f"{side}-{width_um}.png"
            write_scan(file, side, width_um)
            child = [
                sys.executable,
                "-m",
                "laboratory.benchmarks",
                "memory",
                "--one",
                what,
                file,
                str(width_um),
                str(height_nm),
            ]
            done = subprocess.run(child, capture_output=True, text=True, check=True)
            row = {"what": what, "side": side, "width_um": width_um, "height_nm": height_nm, **json.loads(done.stdout)}
            rows.append(row)
            report.say(
                f"{what:<10} {side:>7} {width_um:>5} {height_nm:>5}  {machine.in_words(row['expected_bytes']):>9} "
                f"{machine.in_words(row['bytes']):>9}  {row['expected_seconds']:>6.0f} s {row['seconds']:>4.0f} s",
                arguments.json,
            )
    report.write({"rows": rows}, arguments.json)
