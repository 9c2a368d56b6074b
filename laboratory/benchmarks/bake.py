# SPDX-License-Identifier: GPL-3.0-or-later
"""The time of a bake and of its self-check, stage by stage, in Fourier transforms of the scan's size.

    ./dev bench bake [--runs N] [--shared DIR] [--output docs] [--json FILE|-]

Each bake runs in a process of its own, so that the peak of memory is the bake's. Of the runs, the one that took the
least processor time counts. A transform is a complex one of the scan's size in double precision (`np.fft.fft2`), timed
beside the bake. DIR is the folder of real scans, by default shared/data beside the repository.
`--output` writes speed.md with the memory that the scan takes.
"""

import argparse
import importlib
import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np

from precompute.bake import make
from precompute.bake.request import BakeRequest, Scan
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.presets.presets import draft_request

from ..speed.result import machine
from ..speed.surfaces import SHARED, SKINS
from ..study.pages import filled, write_page
from . import report

# The functions of each stage, as precompute's modules name them. The time of a function does not contain that of the
# other functions that it calls.
BAKE = {
    "read": ("bake.make.level", "bake.make.relief_of", "bake.request.read_height_map"),
    "transforms": ("bake.ensemble.fast_series",),
    "terms and texels": ("bake.ensemble.probe",),
    "resampling": ("bake.ensemble.channels_over_w2",),
    "albedo": ("bake.ensemble.largest_albedo",),
    "sample set": ("bake.ensemble.make_sample_set",),
    "basis": ("bake.make.comparison", "bake.make.with_learnt_basis"),
    "blur levels": ("bake.make.with_levels",),
    "writing": ("table.atlas.pack", "bake.make.write_together"),
}
CHECK = {
    "check: pairs": ("bake.self_check.pairs_within",),
    "check: sums over bins": ("bake.self_check._truths",),
    "check: exact transforms": ("bake.self_check.exact_error",),
    "check: table": ("bake.self_check.measure",),
    "check: wide kernels": ("bake.make.wide_errors",),
    "check: shown colours": ("bake.make.shown_colours",),
}
REST = "rest"
# The surfaces and qualities, and the number of transforms that a bake's time is compared with.
ROWS = (("elaphe, scan", "good"), ("elaphe, scan", "draft"), ("sample:elaphe", "good"), ("sample:elaphe", "draft"))
PAGE, PLACE = "speed.md", "memory of a bake"
_TRANSFORMS = 24


@contextmanager
def clocked(seconds: Counter[str]) -> Iterator[None]:
    """Add the processor seconds of each stage to `seconds`, and the time outside all of them as REST."""
    running, since, before = [REST], [time.process_time()], {}

    def turn() -> None:
        now = time.process_time()
        seconds[running[-1]] += now - since[0]
        since[0] = now

    def in_stage(stage: str, function: Callable) -> Callable:
        @wraps(function)
        def called(*args: Any, **named: Any) -> Any:
            turn()
            running.append(stage)
            try:
                return function(*args, **named)
            finally:
                turn()
                running.pop()

        return called

    for stage, names in (BAKE | CHECK).items():
        for name in names:
            where, attribute = name.rsplit(".", 1)
            module = importlib.import_module(f"precompute.{where}")
            before[module, attribute] = getattr(module, attribute)
            setattr(module, attribute, in_stage(stage, before[module, attribute]))
    try:
        yield
        turn()
    finally:
        for (module, attribute), function in before.items():
            setattr(module, attribute, function)


def measure(scan: Scan, quality: str, transforms: int = 5) -> dict[str, Any]:
    """Bake a scan in this process: the seconds of the stages and of one transform, and the peak of memory in bytes."""
    request = BakeRequest(scans=(scan,))
    if quality == "draft":
        request = draft_request(request)
    seconds: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder, clocked(seconds):
        height_map = scan.read()
        make.bake_to_folder([height_map], request, Path(folder))
    peak = make.peak_bytes()
    field = np.random.default_rng(0).standard_normal(height_map.height_m.shape) + 0j
    transform = min(_seconds_of_transform(field) for _ in range(transforms))
    return {"stages": dict(seconds), "transform": transform, "peak_bytes": peak, "pixels": list(field.shape)}


def _seconds_of_transform(field: np.ndarray) -> float:
    started = time.process_time()
    np.fft.fft2(field)
    return time.process_time() - started


def scan_of(surface: str, shared: Path) -> Scan | None:
    """The scan of a row; None if its file is absent."""
    if surface.startswith("sample:"):
        return Scan(surface)
    name = surface.split(",")[0]
    path = shared / "snake" / f"{name}_65um.png"
    return Scan(str(path), 65, SKINS[name]) if path.is_file() else None


def in_child(scan: Scan, quality: str) -> dict[str, Any]:
    """What `measure` finds in a process of its own."""
    told = json.dumps([scan.source, scan.size_um, scan.height_nm, quality])
    child = [sys.executable, "-m", "laboratory.benchmarks", "bake", "--one", told]
    return json.loads(subprocess.run(child, stdout=subprocess.PIPE, text=True, check=True).stdout)


def totals(found: dict[str, Any]) -> dict[str, float]:
    """The seconds of the bake and of the self-check, and both over the time of the transforms."""
    stages = found["stages"]
    check = sum(stages.get(stage, 0.0) for stage in CHECK)
    bake, bare = sum(stages.values()) - check, _TRANSFORMS * found["transform"]
    return {"bake": bake, "check": check, "bake_in_transforms": bake / bare, "check_in_transforms": check / bare}


def as_text(name: str, found: dict[str, Any]) -> str:
    """The lines of one row."""
    whole = totals(found)
    lines = [
        f"{name}, {found['pixels'][1]} x {found['pixels'][0]} pixels; {found['transform'] * 1e3:.1f} ms a transform"
    ]
    lines += [f"  {stage:<24} {found['stages'].get(stage, 0.0):7.3f} s" for stage in (*BAKE, REST, *CHECK)]
    for part in ("bake", "check"):
        lines.append(f"  {part} in all: {whole[part]:.2f} s, {whole[f'{part}_in_transforms']:.2f} x 24 transforms")
    share, peak = whole["check"] / whole["bake"], found["peak_bytes"] or 0
    lines.append(
        f"  check over bake: {share:.2f}; both: {whole['bake'] + whole['check']:.2f} s; {peak / 2**20:.0f} MiB"
    )
    return "\n".join(lines)


def main(argv: list[str]) -> None:
    """Measure every row, and print its stages."""
    parser = OneLineParser(prog="./dev bench bake", description=__doc__.splitlines()[0])
    parser.add_argument(
        "--runs", type=count(1, 1000), default=3, metavar="N", help="runs of each row (default: %(default)s)"
    )
    parser.add_argument("--shared", type=Path, default=SHARED, metavar="DIR")
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help=f"write {PAGE} into a folder")
    parser.add_argument("--one", metavar="JSON", help=argparse.SUPPRESS)
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    if arguments.one:
        *scan, quality = json.loads(arguments.one)
        print(json.dumps(measure(Scan(*scan), quality)))
        return
    if arguments.output and scan_of(ROWS[0][0], arguments.shared) is None:
        parser.error(f"--output: the scan is not in {arguments.shared}")
    on = machine()
    report.say(
        f"{on.processor}, {on.cores} cores; Python {on.python}, NumPy {on.numpy}; load {on.load}", arguments.json
    )
    rows = {}
    for surface, quality in ROWS:
        scan = scan_of(surface, arguments.shared)
        name = f"{surface}, {quality}"
        if scan is None:
            report.say(f"{name}: skipped, the scan is not in {arguments.shared}", arguments.json)
            continue
        runs = [in_child(scan, quality) for _ in range(arguments.runs)]
        rows[name] = min(runs, key=lambda found: sum(found["stages"].values()))
        report.say(as_text(name, rows[name]), arguments.json)
    report.write({"processor": on.processor, "rows": {name: found | totals(found) for name, found in rows.items()}},
                 arguments.json)  # fmt: skip
    if arguments.output:
        figures = {PLACE: f"{rows[', '.join(ROWS[0])]['peak_bytes'] / 2**20:.0f} MiB"}
        write_page(arguments.output, PAGE, filled(PAGE, figures, part=PLACE), part=PLACE)
