# SPDX-License-Identifier: GPL-3.0-or-later
"""Size, time and error of bakes of different matters.

    ./dev bench matters [SAMPLE ...] [--quick] [--json FILE|-]

Each sample is baked as a dielectric, as gold, under a film and under twelve layers, for a dE00 of 1. `--quick` bakes
for a dE00 of 5 and a coherence length of 4 um. The time is processor seconds of the bake without its self-check.
"""

import time

from precompute.bake.make import make
from precompute.bake.plan import BYTES_PER_TEXEL
from precompute.bake.request import BakeRequest
from precompute.base.failure import GratingError
from precompute.cli.parser import OneLineParser
from precompute.reflectance.matter import parse
from precompute.surface.relief import Relief, prepare
from precompute.surface.samples.catalogue import make_sample

from ..study.pages import table
from . import report

MATTERS = {
    "dielectric": "dielectric",
    "gold": "gold",
    "film": "2/120nm, 1.56",
    "12 layers": "6x(1.68/80nm, 1.56/90nm), 1.56",
}
HEADER = ("sample", "matter", "functions of w", "MiB", "look-ups", "time", "p99")


def facts_of(relief: Relief, request: BakeRequest) -> dict[str, float]:
    """The figures of one bake."""
    begun = time.process_time()
    made = make([relief], request)
    total = time.process_time() - begun
    layout = made.layout
    # A lamp reads each function in two blur levels, and the zero order once.
    look_ups = 2 * layout.terms + 1
    return {
        "terms": layout.terms,
        "mib": layout.height * layout.width * BYTES_PER_TEXEL / 2**20,
        "look_ups": look_ups,
        "seconds": total * made.seconds / (made.seconds + made.check_seconds),
        "p99": made.errors.p99,
    }


def main(argv: list[str] | None = None) -> None:
    """Print the table."""
    parser = OneLineParser(prog="./dev bench matters", description="Size, time and error of bakes by matter.")
    parser.add_argument("samples", nargs="*", default=["blazed", "cd", "elaphe"], metavar="SAMPLE")
    parser.add_argument("--quick", action="store_true", help="a dE00 of 5 and a coherence length of 4 um")
    report.add_json(parser)
    arguments, rows = parser.parse_args(argv), []
    facts: dict[str, dict[str, dict[str, float]]] = {}
    asked = {"delta_e": 5.0, "coherence_length_m": 4e-6} if arguments.quick else {}
    for sample in arguments.samples:
        relief, found = prepare(make_sample(sample)), facts.setdefault(sample, {})
        for name, text in MATTERS.items():
            try:
                one = found[name] = facts_of(relief, BakeRequest(matter=parse(text), **asked))
            except GratingError as error:
                rows.append((sample, name, "refused", "", "", "", ""))
                report.say(f"{sample} {name}: {error}", arguments.json)
                continue
            ratio = one["seconds"] / found["dielectric"]["seconds"]
            told = f"{one['terms']}", f"{one['mib']:.0f}", f"{one['look_ups']}", f"{ratio:.2f}", f"{one['p99']:.2f}"
            rows.append((sample, name, *told))
            report.say("  ".join(rows[-1]), arguments.json)
    report.say(table(HEADER, rows), arguments.json)
    report.write({"matters": facts}, arguments.json)


if __name__ == "__main__":
    main()
