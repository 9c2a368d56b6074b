# SPDX-License-Identifier: GPL-3.0-or-later
"""How far single orders, and the light of all orders, are from Maxwell's equations, by five factors of the spectrum.

    ./dev bench rcwa_orders [--quick] [--picture FILE] [--output DIR] [--json FILE|-]

rcwa_orders_rows.py has the gratings, rcwa_orders_factors.py the factors, rcwa_orders_tables.py the tables. The tables
of single orders leave out orders of less than LEAST of the light: RCWA's own error is about that large. `--picture`
draws how far the first orders of keratin are off, by depth and period; docs/images/ has the picture.
"""

import importlib.util
import sys
from dataclasses import asdict
from pathlib import Path

from precompute.cli.parser import OneLineParser

from . import rcwa_orders_tables as tables
from . import report
from .rcwa_orders_picture import draw
from .rcwa_orders_rows import Row, Total, cases, holds_reflectance, measure, steep


def main(argv: list[str] | None = None) -> None:
    """Print the tables; write rcwa_orders.txt, and the picture if asked for."""
    parser = OneLineParser(prog="./dev bench rcwa_orders", description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("dist", "benchmarks"), metavar="DIR")
    parser.add_argument("--quick", action="store_true", help="few periods, depths and angles")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="draw first orders by depth and period")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    if importlib.util.find_spec("inkstone") is None:
        sys.exit("error: inkstone is not here; remedy: ./dev bench rcwa_orders, in the environment py311-bpy45")
    arguments.output.mkdir(parents=True, exist_ok=True)
    chosen = cases(quick=arguments.quick)
    measured = [measure(case) for case in chosen]
    rows = tables.kept(row for orders, _ in measured for row in orders)
    totals = [total for _, total in measured]
    parts = [tables.orders(rows), tables.rim_by_depth(rows), tables.sums(totals)]
    within = [case for case in chosen if not (case.azimuth_deg or holds_reflectance(case))]
    parts += [tables.largest_sums("the same gratings in the plane", within), tables.largest_sums("steep ones", steep())]
    parts += [tables.convergence(quick=arguments.quick)]
    text = "\n\n".join(parts)
    report.say(text, arguments.json)
    (arguments.output / "rcwa_orders.txt").write_text(text + "\n")
    if arguments.picture:
        draw(arguments.picture, rows)
    facts = {"rows": [_record(row) for row in rows], "totals": [_record(total) for total in totals]}
    report.write(facts, arguments.json)


def _record(one: Row | Total) -> dict:
    """A row or a total for JSON, which has no complex numbers."""
    facts = asdict(one)
    facts["case"]["index"] = _parts(facts["case"]["index"])
    facts["case"]["films"] = [(_parts(index), thickness) for index, thickness in facts["case"]["films"]]
    return facts


def _parts(index: complex) -> list[float]:
    return [complex(index).real, complex(index).imag]


if __name__ == "__main__":
    main()
