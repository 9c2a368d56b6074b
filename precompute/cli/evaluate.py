# SPDX-License-Identifier: GPL-3.0-or-later
"""`evaluate`: the period that each method's colours tell of."""

import argparse
from pathlib import Path

import numpy as np

from ..base.failure import GratingError
from ..base.files import write_whole
from ..methods.method import Settings
from ..methods.registry import METHODS
from ..study import evaluation, evaluation_plot, plots
from ..study.colour_comparison import compare_bake
from ..surface.relief import prepare
from ..surface.unit_cell import grating_period
from .arguments import add_input, coherence_argument, height_map_of, period_of
from .output import Progress, emit


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `evaluate`."""
    add_input(parser)
    parser.add_argument("--theta-i", type=float, default=75.0, metavar="DEG", help="angle of the light; default 75")
    parser.add_argument(
        "--azimuth", type=int, choices=(0, 90, 180, 270), default=180,
        help="of the light, from T (to the right of the scan) towards B (up); default 180, as in maps",
    )  # fmt: skip
    parser.add_argument(
        "--methods", type=methods_argument, default=evaluation.DEFAULT_METHODS, metavar="A,B,...",
        help="default: " + ",".join(evaluation.DEFAULT_METHODS) + "; and nmm-jacobian, bake",
    )  # fmt: skip
    parser.add_argument(
        "--period-nm", type=float, metavar="NM",
        help="of the grating: peaks are looked for around it and angles held against it; default: it is found in the "
        "relief, and angles are held against the mean of each method's own peaks",
    )  # fmt: skip
    parser.add_argument(
        "--coherence-um", type=coherence_argument, default=65.0, metavar="auto|UM",
        help="default 65, the thesis's; the bake takes auto unless a length is given",
    )  # fmt: skip
    parser.add_argument(
        "--precision", choices=("float32", "float64"), default="float32", help="of Taylor and Chebyshev"
    )
    parser.add_argument("-o", "--output", type=Path, metavar="PNG", help="plot of response over wavelength and angle")
    parser.set_defaults(output_is_file=True)


def methods_argument(text: str) -> tuple[str, ...]:
    """Names of methods, split at commas."""
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    for name in names:
        if name not in METHODS:
            raise argparse.ArgumentTypeError(f"{name}: no such method; choose from {', '.join(METHODS)}")
    return names


def run(arguments: argparse.Namespace) -> None:
    """The `evaluate` verb: a table, and the plot."""
    if not 0 <= arguments.theta_i < 90:
        raise GratingError(f"--theta-i {arguments.theta_i:g}: not an angle of light; give 0 to below 90")
    if arguments.output is not None and arguments.output.suffix.lower() != ".png":
        raise GratingError(f"{arguments.output}: not a PNG; name the file .png")
    asked_m = period_of(arguments)
    if arguments.output is not None:
        plots.pyplot()
    relief = prepare(evaluation.turned(height_map_of(arguments), arguments.azimuth))
    around_m = grating_period(relief, asked_m)
    progress = Progress(arguments.progress)
    theta_i = np.radians(arguments.theta_i)
    found, plotted = {}, []
    for k, name in enumerate(arguments.methods):
        settings = evaluation_settings(arguments, name, around_m)
        if name == "bake":
            found[name] = compare_bake(relief, settings, theta_i, around_m).as_dict()
        else:
            one = evaluation.evaluate_method(name, relief, settings, theta_i, around_m, asked_m)
            plotted.append(one)
            found[name] = one.as_dict()
        progress(name, (k + 1) / len(arguments.methods))
    facts = {
        "source": arguments.file,
        "theta_i_deg": arguments.theta_i,
        "azimuth_deg": arguments.azimuth,
        "coherence_um": arguments.coherence_um,
        "looked_around_nm": around_m * 1e9,
        "angles_against": "mean of own peaks" if asked_m is None else "--period-nm",
        "methods": found,
        "files": [],
    }
    if arguments.output is not None and plotted:
        arguments.output.parent.mkdir(parents=True, exist_ok=True)
        title = f"{arguments.file}, light at {arguments.theta_i:g} degrees"
        write_whole(arguments.output, lambda path: evaluation_plot.plot(path, plotted, title))
        facts["files"] = [str(arguments.output)]
    emit(facts, arguments.json, lambda: evaluation_table(facts))


def evaluation_settings(arguments, name: str, period_m: float) -> Settings:
    """Settings for one method. A bake of 65 um would need a finer table than there is: by default it chooses."""
    length_um = arguments.coherence_um
    if name == "bake" and length_um == 65.0:
        length_um = None
    return Settings(
        coherence_length_m=None if length_um is None else length_um * 1e-6,
        dtype=np.dtype(arguments.precision).type,
        period_m=period_m,
    )


def evaluation_table(facts: dict) -> str:
    """The table for people."""
    lines = [f"first order around {facts['looked_around_nm']:.2f} nm; angles against: {facts['angles_against']}"]
    lines.append(f"{'method':<16} {'period nm':>10} {'variance':>9} {'angle rms':>10} {'seconds':>8}")
    for name, one in facts["methods"].items():
        if name == "bake":
            lines.append(
                f"{name:<16} brightest at {one['peak_angle_deg']:.3f} degrees, the reference at "
                f"{one['reference_peak_angle_deg']:.3f}; dominant wavelength rms "
                f"{one['dominant_wavelength_rms_nm']:.2f} nm; |dY| {one['relative_dy']:.2%}; {one['seconds']:.1f} s"
            )
        else:
            lines.append(
                f"{name:<16} {one['period_mean_nm']:>10.3f} {one['period_variance_nm']:>9.4f} "
                f"{one['peak_angle_rms_deg']:>10.5f} {one['seconds']:>8.2f}"
            )
    return "\n".join([*lines, *facts["files"]])
