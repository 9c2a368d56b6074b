# SPDX-License-Identifier: GPL-3.0-or-later
"""The `evaluate` verb: the period implied by each method's colours."""

import argparse
from dataclasses import dataclass, field

import numpy as np

from precompute.base.failure import GratingError
from precompute.base.files import write_whole
from precompute.cli.arguments import (
    PERIOD_NM,
    add_input,
    coherence_argument,
    count,
    height_map_of,
    naming,
    number,
    path_argument,
    period_of,
)
from precompute.cli.printing import Progress, emit
from precompute.methods import baked
from precompute.methods.method import Settings
from precompute.methods.method_registry import ENTRIES
from precompute.optics.coherence import THESIS_COHERENCE_M
from precompute.surface.quality import grating_period
from precompute.surface.relief import prepare

from ..study import evaluation, plots
from ..study.colour_comparison import ColourComparison, compare_bake
from ..study.response import FirstOrder
from ..study.traits import DEFAULT_METHODS, TRAITS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `evaluate`."""
    add_input(parser)
    parser.add_argument(
        "--theta-i", type=number(0, 89.99), default=75.0, metavar="DEG", help="angle of the light; default 75"
    )
    parser.add_argument(
        "--azimuth", type=count(0, 270), choices=(0, 90, 180, 270), default=180,
        help="azimuth of the light, from T (to the right of the scan) towards B (up); default 180, as in maps",
    )  # fmt: skip
    parser.add_argument(
        "--methods", type=methods_argument, default=DEFAULT_METHODS, metavar="A,B,...",
        help="default: " + ",".join(DEFAULT_METHODS) + "; and " + ", ".join(on_request()),
    )  # fmt: skip
    parser.add_argument(
        "--period-nm", type=PERIOD_NM, metavar="NM",
        help="period of the grating: peaks are looked for around it, and angles are compared with it; default: it is "
        "found in the relief, and angles are compared with the mean of each method's own peaks",
    )  # fmt: skip
    parser.add_argument(
        "--coherence-um", type=coherence_argument, default=argparse.SUPPRESS, metavar="auto|UM",
        help="coherence length; default 65, as in the thesis; the bake takes auto unless a length is given",
    )  # fmt: skip
    parser.add_argument(
        "--precision", choices=("float32", "float64"), default="float32", help="of the terms of Taylor and Chebyshev"
    )
    parser.add_argument(
        "-o", "--output", type=path_argument, metavar="PNG", help="plot of the response over wavelength and angle"
    )
    parser.set_defaults(output_is_file=True)


def on_request() -> list[str]:
    """Methods that `evaluate` runs only if --methods names them."""
    spectral = [name for name in ENTRIES if TRAITS[name].has_spectrum and not TRAITS[name].by_default]
    return [*spectral, baked.ENTRY.name]


@dataclass(frozen=True)
class Report:
    """The result of `evaluate`: its arguments, then one result for each method in the given order."""

    source: str
    theta_i_deg: float
    azimuth_deg: int
    coherence_um: float | None
    looked_around_nm: float
    angles_against: str
    methods: dict[str, evaluation.Evaluation | ColourComparison] = field(default_factory=dict)
    files: list[str] = field(default_factory=list)

    def as_dict(self) -> dict:
        """A record for JSON."""
        return vars(self) | {"methods": {name: one.as_dict() for name, one in self.methods.items()}}

    def table(self) -> list[str]:
        """The lines of the printed table."""
        lines = [f"first order around {self.looked_around_nm:.2f} nm; angles against: {self.angles_against}"]
        lines.append(f"{'method':<16} {'period nm':>10} {'variance':>9} {'angle rms':>10} {'seconds':>8}")
        lines += [f"{name:<16} {one.summary()}" for name, one in self.methods.items()]
        return [*lines, *self.files]


def methods_argument(text: str) -> tuple[str, ...]:
    """Split a comma-separated list of method names."""
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    for name in names:
        if name not in ENTRIES:
            raise argparse.ArgumentTypeError(f"{name}: no such method; choose from {', '.join(ENTRIES)}")
    return names


def run(arguments: argparse.Namespace) -> None:
    """Run `evaluate`: print the table, write the plot."""
    if arguments.output is not None and arguments.output.suffix.lower() != ".png":
        raise GratingError(arguments.output, "not a PNG", "name the file .png")
    asked_m = period_of(arguments)
    if arguments.output is not None:
        plots.pyplot()
    relief = prepare(evaluation.turned(height_map_of(arguments), arguments.azimuth))
    with naming(arguments.file):
        first_order = FirstOrder(np.radians(arguments.theta_i), grating_period(relief, asked_m))
    progress = Progress(arguments.progress)
    report = Report(
        source=arguments.file,
        theta_i_deg=arguments.theta_i,
        azimuth_deg=arguments.azimuth,
        coherence_um=getattr(arguments, "coherence_um", THESIS_COHERENCE_M * 1e6),
        looked_around_nm=first_order.period_m * 1e9,
        angles_against="mean of own peaks" if asked_m is None else "--period-nm",
    )
    plotted = []
    for k, name in enumerate(arguments.methods):
        settings = evaluation_settings(arguments, name, first_order.period_m)
        with naming(arguments.file):
            if name == baked.ENTRY.name:
                report.methods[name] = compare_bake(relief, settings, first_order)
            else:
                one = evaluation.evaluate_method(name, relief, settings, first_order=first_order, expected_m=asked_m)
                plotted.append(one)
                report.methods[name] = one
        progress(name, (k + 1) / len(arguments.methods))
    if arguments.output is not None and plotted:
        arguments.output.parent.mkdir(parents=True, exist_ok=True)
        title = f"{arguments.file}, light at {arguments.theta_i:g} degrees"
        write_whole(arguments.output, lambda path: evaluation.plot(path, plotted, title))
        report.files.append(str(arguments.output))
    emit(report.as_dict(), arguments.json, report.table)


def evaluation_settings(arguments, name: str, period_m: float) -> Settings:
    """Settings for one method. The default coherence length is the thesis's. The bake chooses its own, because the
    thesis's length needs a finer table than any bake can have."""
    unless_given = None if name == baked.ENTRY.name else THESIS_COHERENCE_M * 1e6
    length_um = getattr(arguments, "coherence_um", unless_given)
    return Settings(
        coherence_length_m=None if length_um is None else length_um * 1e-6,
        dtype=np.dtype(arguments.precision).type,
        period_m=period_m,
    )
