# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a bake takes, alone and beside a second bake: in seconds, and relative to 24 FFTs of the relief's size.

    ./dev bench bake [FILE [--size-um UM] [--height-nm NM]] [--runs N] [--json FILE|-]

FILE is by default the Elaphe scan, or the sample that imitates it if ../shared/data lacks the scan. Each bake runs as a
separate process, `bake --no-cache`, which reports its own time; the self-check is timed separately. The transforms are
NumPy's, complex and in double precision. They are timed before, between and after the bakes, and the fastest counts.
"""

import statistics
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from precompute.bake.request import HEIGHT_NM, SIZE_UM, Scan
from precompute.cli.option_types import count, number
from precompute.cli.parser import OneLineParser
from precompute.surface.relief import prepare

from ..speed.run import machine
from ..speed.scan import bake_in_child, transform_seconds
from ..speed.surfaces import SHARED
from . import report

TRANSFORMS = 24
RUNS = 3


def arguments_of(scan: Scan) -> list[str]:
    """Command-line arguments for a scan, with an absolute path because the process may run in another folder."""
    found = [str(Path(scan.source).resolve()) if Path(scan.source).is_file() else scan.source]
    for option, value in (("--size-um", scan.size_um), ("--height-nm", scan.height_nm)):
        found += [] if value is None else [option, repr(value)]
    return found


def elaphe() -> Scan:
    """The Elaphe scan, or the sample that imitates it if the file is missing."""
    path = SHARED / "snake" / "elaphe_65um.png"
    return Scan(str(path), 65.0, 375.0) if path.is_file() else Scan("sample:elaphe")


def bakes(scan: Scan, count: int) -> list[dict]:
    """Run `count` bakes of a scan at the same time; returns the figures that each reports."""

    def one(_: int) -> dict:
        with tempfile.TemporaryDirectory() as folder:
            return bake_in_child(arguments_of(scan), Path(folder))

    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(one, range(count)))


def measure(scan: Scan, runs: int = RUNS) -> dict:
    """Seconds and ratios of `runs` single bakes and of `runs` pairs of simultaneous bakes."""
    height_map = scan.read()
    shape = prepare(height_map).height_m.shape
    facts = {
        "machine": asdict(machine()),
        "surface": height_map.source_name,
        "pixels": list(shape),
        "transforms": TRANSFORMS,
    }
    transform = transform_seconds(shape)
    alone, beside = [], []
    for _ in range(runs):
        alone += bakes(scan, 1)
        transform = min(transform, transform_seconds(shape))
        beside += bakes(scan, 2)
        transform = min(transform, transform_seconds(shape))
    facts["transform_seconds"] = transform
    for name, found in (("alone", alone), ("beside", beside)):
        seconds = [each["seconds"] for each in found]
        median = statistics.median(seconds)
        facts[name] = {
            "seconds": seconds,
            "check_seconds": [each["check_seconds"] for each in found],
            "median": median,
            "best": min(seconds),
            "median_to_transforms": median / (TRANSFORMS * transform),
            "best_to_transforms": min(seconds) / (TRANSFORMS * transform),
        }
    facts["beside_to_alone"] = facts["beside"]["median"] / facts["alone"]["median"]
    return facts


def as_text(facts: dict) -> str:
    """The printed table."""
    on, rows, columns = facts["machine"], *facts["pixels"]
    lines = [
        f"{on['processor']}, {on['cores']} cores, load {on['load']}, NumPy {on['numpy']}",
        f"{facts['transforms']} transforms of {columns} x {rows}: "
        f"{facts['transforms'] * facts['transform_seconds']:.2f} s",
        f"{'bake':<22}{'median s':>9}{'best s':>9}{'to transforms, median':>23}{'best':>7}{'self-check s':>14}",
    ]
    for name, label in (("alone", "alone"), ("beside", "beside a second bake")):
        one = facts[name]
        lines.append(
            f"{label:<22}{one['median']:>9.2f}{one['best']:>9.2f}{one['median_to_transforms']:>23.2f}"
            f"{one['best_to_transforms']:>7.2f}{statistics.median(one['check_seconds']):>14.2f}"
        )
    return "\n".join([*lines, f"beside a second bake {facts['beside_to_alone']:.2f} times as long as alone"])


def main(argv: list[str] | None = None) -> None:
    """Print the table."""
    parser = OneLineParser(prog="./dev bench bake", description=__doc__.splitlines()[0])
    parser.add_argument("file", nargs="?", metavar="FILE", help="height map or sample:NAME; default: the Elaphe scan")
    parser.add_argument("--size-um", type=number(*SIZE_UM), metavar="UM", help="width of the scan (pictures)")
    parser.add_argument(
        "--height-nm", type=number(*HEIGHT_NM), metavar="NM", help="height from black to white (pictures)"
    )
    parser.add_argument(
        "--runs", type=count(1, 1000), default=RUNS, metavar="N", help=f"bakes alone, and pairs; default {RUNS}"
    )
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    if arguments.runs < 1:
        parser.error(f"--runs {arguments.runs}: not a number of bakes; give 1 or more")
    scan = Scan(arguments.file, arguments.size_um, arguments.height_nm) if arguments.file else elaphe()
    facts = measure(scan, arguments.runs)
    report.say(as_text(facts), arguments.json)
    report.write(facts, arguments.json)


if __name__ == "__main__":
    main()
