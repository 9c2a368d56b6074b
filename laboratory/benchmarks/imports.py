# SPDX-License-Identifier: GPL-3.0-or-later
"""Time and peak memory of importing a large scan.

    ./dev bench imports [--side N] [--json FILE|-]

A child process reads and describes a picture of N x N pixels of 16 bits (4096 by default), as the import dialog and
`info` do; the fastest of three runs counts. The import must take under 2 s and at most 3 times the memory of its
heights, 8 bytes a pixel; otherwise the exit status is 1. Processor time is given too: a busy machine lengthens it less.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from precompute.bake.bake_folder import peak_bytes
from precompute.cli.option_types import count
from precompute.cli.parser import OneLineParser
from precompute.surface.description import describe
from precompute.surface.readers.reader_registry import read_height_map

from . import report
from .memory import write_scan

SECONDS_MAX, TIMES_MAX = 2.0, 3.0
RUNS = 3
# The scan's width and height; its waves are some micrometres long.
WIDTH_UM, HEIGHT_NM = 200.0, 300.0


def measure(file: Path) -> dict[str, float]:
    """Seconds of reading and of describing in this process, and its memory growth relative to the heights' memory."""
    before, started, processor = peak_bytes(), time.perf_counter(), time.process_time()
    height_map = read_height_map(str(file), WIDTH_UM, HEIGHT_NM)
    read = time.perf_counter()
    describe(height_map)
    return {
        "read_seconds": read - started,
        "seconds": time.perf_counter() - started,
        "processor_seconds": time.process_time() - processor,
        "times_the_heights": (peak_bytes() - before) / height_map.height_m.nbytes,
    }


def measured(file: Path) -> dict[str, float]:
    """Run `measure` in a separate process."""
    child = [sys.executable, "-m", "laboratory.benchmarks", "imports", "--one", str(file)]
    return json.loads(subprocess.run(child, capture_output=True, text=True, check=True).stdout)


def main(argv: list[str]) -> int:
    """Measure one import and print it. Returns 1 if it is too slow or needs too much memory."""
    parser = OneLineParser(prog="./dev bench imports", description=__doc__.splitlines()[0])
    parser.add_argument("--side", type=count(64, 8192), default=4096, metavar="N", help="pixels a side; default 4096")
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    if arguments.one:
        print(json.dumps(measure(arguments.one)))
        return 0
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "large.png"
        write_scan(file, arguments.side, WIDTH_UM)
        found = min((measured(file) for _ in range(RUNS)), key=lambda run: run["seconds"])
    report.say(
        f"{arguments.side} x {arguments.side} of 16 bits: {found['seconds']:.2f} s (at most {SECONDS_MAX:g}), "
        f"{found['processor_seconds']:.2f} s of the processor, {found['read_seconds']:.2f} s to read; "
        f"{found['times_the_heights']:.2f} times the heights (at most {TIMES_MAX:g})",
        arguments.json,
    )
    report.write({"side": arguments.side, **found}, arguments.json)
    return int(found["seconds"] > SECONDS_MAX or found["times_the_heights"] > TIMES_MAX)
