# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: `info`, `bake`, `dft`, `check`, `map`, `evaluate`, `efficiency`, `benchmark`. Whatever is wrong,
one line of fault and remedy, and a non-zero exit."""

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from . import atlas, benchmark, benchmark_page, brdf_map, cache, dft_images, efficiency, evaluation, info, lobes, plots
from .bake import bake, plan
from .baking import MODELS, Order, bake_to_folder
from .check import check
from .colour import ILLUMINANTS
from .failure import GratingError
from .height_map import HeightMap
from .methods import METHODS, Settings
from .methods.unit_cell import grating_period
from .needs import EVERYTHING, read_needs
from .readers import read_height_map
from .relief import Relief, prepare

# The patch model's reference sums every pixel anew for every direction: hours for a picture.
MAP_METHODS = tuple(name for name in METHODS if name != "reference-patch")


class Progress:
    """Reports stages on standard error: lines for people, or JSON lines for the program that started us."""

    def __init__(self, style: str):
        self.style = style
        self._last = (None, -1.0)

    def __call__(self, stage: str, fraction: float) -> None:
        last_stage, last_fraction = self._last
        step = 0.01 if self.style == "json" else 0.25
        if self.style == "none" or (stage == last_stage and fraction < min(1.0, last_fraction + step)):
            return
        self._last = (stage, fraction)
        if self.style == "json":
            line = json.dumps({"stage": stage, "fraction": round(fraction, 4)})
        else:
            line = f"{stage}: {fraction:4.0%}"
        print(line, file=sys.stderr, flush=True)


class OneLineParser(argparse.ArgumentParser):
    """A parser whose complaint is one line."""

    def error(self, message: str):
        print(f"error: {message}; see `{self.prog} --help`", file=sys.stderr)
        sys.exit(2)


def main(argv: list[str] | None = None) -> int:
    """Run one verb; the exit status."""
    arguments = build_parser().parse_args(argv)
    try:
        check_targets(arguments)
        arguments.run(arguments)
    except GratingError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except MemoryError:
        print("error: not enough memory; crop the scan or ask for a shorter coherence length", file=sys.stderr)
        return 1
    except BrokenPipeError:  # whoever read our output has had enough
        sys.stderr.close()
        return 1
    except OSError as error:
        what = f"{error.filename}: {error.strerror}" if error.filename else error
        print(f"error: {what}; check the path and its permissions", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("error: interrupted; nothing was written", file=sys.stderr)
        return 130
    return 0


def build_parser() -> argparse.ArgumentParser:
    """The parser of every verb, shared with `blender --command grating`."""
    parser = OneLineParser(prog="grating", description="From a height map to a diffraction table.")
    verbs = parser.add_subparsers(required=True, metavar="VERB", parser_class=OneLineParser)

    describe = verbs.add_parser("info", help="size, relief and periods of a height map")
    add_input(describe)
    describe.set_defaults(run=run_info)

    table = verbs.add_parser("bake", help="bake height maps into the table that the material reads")
    add_input(table, several=True)
    table.add_argument("-o", "--output", required=True, type=Path, metavar="DIR", help="folder for the bake")
    add_bake_options(table)
    table.set_defaults(run=run_bake)

    images = verbs.add_parser("dft", help="the images that the OSL shaders of the thesis's algorithms read, one .exr")
    add_input(images)
    images.add_argument("-o", "--output", required=True, type=Path, metavar="DIR", help="folder for the images")
    images.add_argument(
        "--method", choices=dft_images.DFT_METHODS, default="flss",
        help="that will read them; chebyshev is FLSS for reliefs too deep for Taylor's series; default flss",
    )  # fmt: skip
    images.add_argument("--terms", type=int, metavar="N", help="terms of the expansion; default: by error bound")
    images.add_argument("--step-nm", type=float, default=5.0, metavar="NM", help="wavelength step; default 5")
    images.add_argument(
        "--texels", type=int, choices=(0, *range(1, 32, 2)), default=3, metavar="N",
        help="read, a side, odd; 0: as many as the window reaches; default 3",
    )  # fmt: skip
    images.add_argument("--coherence-um", type=coherence_argument, default=65.0, metavar="UM", help="default 65")
    images.add_argument("--period-nm", type=float, metavar="NM", help="of the grating (nmm); default: found")
    images.set_defaults(run=run_dft)

    verify = verbs.add_parser("check", help="recompute a bake's error from its files alone")
    verify.add_argument("bake", metavar="BAKE", help=".exr, or a folder that holds one")
    add_input(verify, several=True)
    verify.add_argument(
        "--delta-e", type=float, metavar="DE", help="what it must keep; default: what its bake was asked"
    )
    verify.add_argument("--groups", type=int, default=2, metavar="N", help="values of w; default 2")
    verify.add_argument("--pairs", type=int, default=4000, metavar="N", help="direction pairs of each; default 4000")
    verify.add_argument("--step-nm", type=float, metavar="NM", help="wavelength step; default 1 to 3, by the kernel")
    verify.set_defaults(run=run_check)

    chart = verbs.add_parser("map", help="BRDF map over the hemisphere of view")
    add_input(chart)
    chart.add_argument("-o", "--output", required=True, type=Path, metavar="PNG|EXR")
    chart.add_argument("--method", choices=MAP_METHODS, default="bake")
    chart.add_argument(
        "--theta-i", type=float, default=0.0, metavar="DEG", help="angle of the light, from -x; default 0"
    )
    chart.add_argument("--step-nm", type=float, default=5.0, metavar="NM", help="wavelength step; default 5")
    chart.add_argument("--terms", type=int, metavar="N", help="terms of Taylor or Chebyshev; default: by error bound")
    chart.add_argument("--precision", choices=("float32", "float64"), default="float32", help="of those terms")
    chart.add_argument("--centred", action="store_true", help="Taylor about the middle of the relief, not its floor")
    chart.add_argument("--period-nm", type=float, metavar="NM", help="of the grating (nmm, stam, gem); default: found")
    chart.add_argument("--size", type=int, default=512, metavar="PIXELS")
    chart.add_argument("--coherence-um", type=coherence_argument, default=None, metavar="auto|UM")
    chart.add_argument(
        "--form", choices=("conserving", "stam"), default="conserving", help="limited to the light received, or not"
    )
    chart.set_defaults(run=run_map)

    judge = verbs.add_parser("evaluate", help="the period that each method's colours tell of")
    add_input(judge)
    judge.add_argument("--theta-i", type=float, default=75.0, metavar="DEG", help="angle of the light; default 75")
    judge.add_argument(
        "--azimuth", type=int, choices=(0, 90, 180, 270), default=180,
        help="of the light, from T (to the right of the scan) towards B (up); default 180, as in maps",
    )  # fmt: skip
    judge.add_argument(
        "--methods", type=methods_argument, default=evaluation.DEFAULT_METHODS, metavar="A,B,...",
        help="default: " + ",".join(evaluation.DEFAULT_METHODS) + "; and nmm-jacobian, bake",
    )  # fmt: skip
    judge.add_argument(
        "--period-nm", type=float, metavar="NM",
        help="of the grating: peaks are looked for around it and angles held against it; default: it is found in the "
        "relief, and angles are held against the mean of each method's own peaks",
    )  # fmt: skip
    judge.add_argument(
        "--coherence-um", type=coherence_argument, default=65.0, metavar="auto|UM",
        help="default 65, the thesis's; the bake takes auto unless a length is given",
    )  # fmt: skip
    judge.add_argument("--precision", choices=("float32", "float64"), default="float32", help="of Taylor and Chebyshev")
    judge.add_argument("-o", "--output", type=Path, metavar="PNG", help="plot of response over wavelength and angle")
    judge.set_defaults(run=run_evaluate)

    orders = verbs.add_parser("efficiency", help="a grating's orders against their closed forms")
    orders.add_argument("profile", choices=efficiency.PROFILES)
    orders.add_argument("--period-um", type=float, required=True, metavar="UM")
    orders.add_argument("--depth-nm", type=float, required=True, metavar="NM", help="from trough to crest")
    orders.add_argument("--wavelength-nm", type=float, required=True, metavar="NM")
    orders.add_argument("--theta-i", type=float, default=0.0, metavar="DEG", help="angle of the light; default 0")
    orders.add_argument("--orders", type=int, default=3, metavar="M", help="orders -M to M; default 3")
    orders.add_argument("--samples", type=int, default=2048, metavar="N", help="samples of a period; default 2048")
    orders.add_argument("--json", metavar="FILE|-", help="write the result as JSON")
    orders.set_defaults(run=run_efficiency)

    speed = verbs.add_parser("benchmark", help="speed against error: every method on the same surfaces")
    speed.add_argument("--quick", action="store_true", help="a minute's run of small pieces: a trial, no result")
    speed.add_argument(
        "-o", "--output", type=Path, default=Path("benchmark"), metavar="DIR",
        help=f"folder for {benchmark_page.PAGE} and its pictures; default benchmark",
    )  # fmt: skip
    speed.add_argument("--shared", type=Path, metavar="DIR", help="real scans; default ../shared/data, if there")
    speed.add_argument("--json", metavar="FILE|-", help="write the result as JSON")
    speed.add_argument("--progress", choices=("text", "json", "none"), default="text", help=argparse.SUPPRESS)
    speed.set_defaults(run=run_benchmark)
    return parser


def add_input(parser: argparse.ArgumentParser, several: bool = False) -> None:
    """FILE and what a file without units needs."""
    text = "height map, or sample:NAME (" + ", ".join(sample_names()) + ")"
    if several:
        parser.add_argument("files", nargs="+", metavar="FILE", help=text + "; several scans of one skin are averaged")
    else:
        parser.add_argument("file", metavar="FILE", help=text)
    parser.add_argument("--size-um", type=float, metavar="W", help="width of the scan in micrometres (pictures)")
    parser.add_argument(
        "--height-nm", type=float, metavar="H", help="height from black to white in nanometres (pictures)"
    )
    parser.add_argument("--channel", help="which of the file's channels, by name")
    parser.add_argument("--json", metavar="FILE|-", help="write the result as JSON")
    parser.add_argument("--progress", choices=("text", "json", "none"), default="text", help=argparse.SUPPRESS)


def add_bake_options(parser: argparse.ArgumentParser) -> None:
    """What steers a bake."""
    parser.add_argument(
        "--delta-e", type=float, default=1.0, metavar="DE", help="99th percentile of CIEDE2000; default 1"
    )
    parser.add_argument(
        "--coherence-um", type=coherence_argument, default=None, metavar="auto|UM",
        help="coherence length at 550 nm (4 sigma); auto averages at least 30 areas of the scan",
    )  # fmt: skip
    parser.add_argument(
        "--model", choices=MODELS, default="ensemble",
        help="of coherence: the mean over a window's places, or the thesis's patch under one window, 65 um unless a "
        "length is given; default ensemble",
    )  # fmt: skip
    parser.add_argument(
        "--needs", type=Path, metavar="NEEDS.json", help="bake only what a scene reaches (docs/needs.md)"
    )
    parser.add_argument("--illuminant", choices=ILLUMINANTS, default="D65", help="what counts as white; default D65")
    parser.add_argument("--no-cache", action="store_true", help="bake even what has been baked before")


def sample_names() -> tuple[str, ...]:
    """Names that `sample:NAME` takes."""
    from .samples import SAMPLES

    return tuple(SAMPLES)


def coherence_argument(text: str) -> float | None:
    """Micrometres, or None for auto."""
    if text == "auto":
        return None
    value = float(text)
    if not 0 < value < 1e4:
        raise argparse.ArgumentTypeError(f"{text} um is no coherence length")
    return value


def methods_argument(text: str) -> tuple[str, ...]:
    """Names of methods, split at commas."""
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    for name in names:
        if name not in METHODS:
            raise argparse.ArgumentTypeError(f"{name}: no such method; choose from {', '.join(METHODS)}")
    return names


def run_info(arguments) -> None:
    """The `info` verb."""
    facts = info.describe(height_map_of(arguments))
    emit(facts, arguments.json, lambda: "\n".join(f"{key}: {value}" for key, value in facts.items()))


def run_bake(arguments) -> None:
    """The `bake` verb: bake, measure, write."""
    if not 0 < arguments.delta_e < 100:
        raise GratingError(
            f"--delta-e {arguments.delta_e:g}: not a colour difference; give a number from 0 to 100, such as 1"
        )
    order = order_of(arguments)
    height_maps = [height_map_of(arguments, file) for file in arguments.files]
    progress = Progress(arguments.progress)

    def make(folder: Path) -> dict:
        return bake_to_folder(height_maps, order, folder, progress)

    if arguments.no_cache:
        facts = {**make(arguments.output), "cached": False}
    else:
        facts = cache.bake_once(cache.key_of(height_maps, asdict(order)), arguments.output, make, progress)
    emit(facts, arguments.json, lambda: bake_summary(facts))


def run_dft(arguments) -> None:
    """The `dft` verb: transform, write."""
    check_sampling(arguments)
    settings = dft_images.settings_for(
        coherence_length_m=None if arguments.coherence_um is None else arguments.coherence_um * 1e-6,
        terms=arguments.terms,
        step_m=arguments.step_nm * 1e-9,
        texels=arguments.texels,
        period_m=period_of(arguments),
    )
    facts = dft_images.images_to_folder(
        height_map_of(arguments), arguments.method, settings, arguments.output, Progress(arguments.progress)
    )
    size = facts["image_bytes"] / 2**20
    emit(facts, arguments.json, lambda: f"{facts['files'][0]}: {facts['terms']} terms, {size:.0f} MiB")


def order_of(arguments) -> Order:
    """What the command line asks of a bake."""
    length_m = None if arguments.coherence_um is None else arguments.coherence_um * 1e-6
    needs = EVERYTHING if arguments.needs is None else read_needs(arguments.needs)
    return Order(arguments.delta_e, length_m, arguments.illuminant, needs, arguments.model)


def bake_summary(facts: dict) -> str:
    """The two lines that a person reads after a bake."""
    de = facts["delta_e"]
    origin = "from the cache, baked in " if facts["cached"] else ""
    return (
        f"{facts['files'][0]}: {facts['tiles']} tiles of {facts['tile'][1]} x {facts['tile'][0]}, "
        f"coherence {facts['coherence_um']:.1f} um, {facts['blender_bytes'] / 2**20:.0f} MiB in Blender, "
        f"{origin}{facts['seconds']:.1f} s\n"
        f"dE00 mean {de['mean']:.2f}, p95 {de['p95']:.2f}, p99 {de['p99']:.2f}, max {de['max']:.2f} "
        f"({de['pairs']} direction pairs, {facts['check_seconds']:.1f} s)"
    )


def run_check(arguments) -> None:
    """The `check` verb: the figures, and an error if the bake does not keep what it was asked."""
    if arguments.delta_e is not None and not 0 < arguments.delta_e < 100:
        raise GratingError(f"--delta-e {arguments.delta_e:g}: not a colour difference; give a number from 0 to 100")
    for option, most in (("groups", 1000), ("pairs", 10**6)):
        if not 1 <= getattr(arguments, option) <= most:
            raise GratingError(f"--{option} {getattr(arguments, option)}: not a number of them; give 1 to {most}")
    if arguments.step_nm is not None and not 0.1 <= arguments.step_nm <= 100:
        raise GratingError(f"--step-nm {arguments.step_nm:g}: not a wavelength step; give 0.1 to 100")
    file = existing_bake(arguments.bake)
    if file is None:
        raise GratingError(f"{arguments.bake}: there is no bake; give the .exr that `bake` wrote, or its folder")
    verdict = check(
        file, [height_map_of(arguments, each) for each in arguments.files], arguments.delta_e, arguments.groups,
        arguments.pairs, None if arguments.step_nm is None else arguments.step_nm * 1e-9, Progress(arguments.progress),
    )  # fmt: skip
    if arguments.json or not verdict.faults:
        facts = {"bake": str(file), **verdict.as_dict()}
        emit(facts, arguments.json, lambda: check_summary(facts))
    if verdict.faults:
        raise GratingError(f"{file}: {', '.join(verdict.faults)}; bake it again")


def check_summary(facts: dict) -> str:
    """The two lines that a person reads after a check."""
    de = facts["delta_e"]
    rings = ", ".join(
        f"{ring['u_from']:g} to {ring['u_to']:g}: {ring['relative_dy']:.2%}"
        for ring in facts["rings"]
        if ring["light"] > 1e-3
    )
    return (
        f"{facts['bake']}: dE00 mean {de['mean']:.2f}, p95 {de['p95']:.2f}, p99 {de['p99']:.2f}, max {de['max']:.2f} "
        f"(asked {facts['asked_delta_e']:g}; {de['pairs']} direction pairs, {facts['seconds']:.1f} s)\n"
        f"|dY| {de['relative_dy']:.2%} of the light (by |u|: {rings}), zero order {facts['zero_order']['dy']:.1e}"
    )


def run_map(arguments) -> None:
    """The `map` verb: a PNG to look at or an EXR of linear Rec.709 radiance under unit irradiance."""
    if arguments.output.suffix.lower() not in (".png", ".exr"):
        raise GratingError(f"{arguments.output}: neither PNG nor EXR; name the file .png or .exr")
    if not -90 < arguments.theta_i < 90:
        raise GratingError(f"--theta-i {arguments.theta_i:g}: below the surface; give an angle between -90 and 90")
    if not 8 <= arguments.size <= 8192:
        raise GratingError(f"--size {arguments.size}: not a picture size; give 8 to 8192")
    check_sampling(arguments)
    period_of(arguments)
    progress = Progress(arguments.progress)
    xyz, illuminant = brdf_map_of(arguments, progress)
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    write_picture(arguments.output, xyz, illuminant)
    emit({"files": [str(arguments.output)]}, arguments.json, lambda: str(arguments.output))


def check_sampling(arguments) -> None:
    """Wavelength step and number of terms must make sense."""
    if not 0.1 <= arguments.step_nm <= 100:
        raise GratingError(f"--step-nm {arguments.step_nm:g}: not a wavelength step; give 0.1 to 100")
    if arguments.terms is not None and not 1 <= arguments.terms <= 1000:
        raise GratingError(f"--terms {arguments.terms}: not a number of terms; give 1 to 1000")


def brdf_map_of(arguments, progress: Progress) -> tuple[np.ndarray, str]:
    """Map (size, size, 3) in XYZ and its illuminant, from a bake's file or folder, or from a height map."""
    theta_i, conserving = np.radians(arguments.theta_i), arguments.form == "conserving"
    file = existing_bake(arguments.file)
    if file is not None:
        if arguments.method != "bake":
            raise GratingError(
                f"{file}: a bake no longer holds the surface; give --method {arguments.method} the height map"
            )
        baked, _ = atlas.read(file)
        return brdf_map.from_bake(baked, arguments.size, theta_i, conserving), baked.illuminant
    length_m = None if arguments.coherence_um is None else arguments.coherence_um * 1e-6
    relief = prepare(height_map_of(arguments))
    if arguments.method == "bake":
        baked = atlas.unpack(*atlas.pack(bake(relief, length_m, progress=progress)))
        return brdf_map.from_bake(baked, arguments.size, theta_i, conserving), baked.illuminant
    if arguments.method != "reference":
        return method_map(relief, length_m, arguments, progress), "D65"
    sigma_b = plan(relief, length_m).sigma_b
    xyz = brdf_map.from_reference(
        relief, sigma_b, arguments.size, theta_i, arguments.step_nm * 1e-9,
        tick=lambda done, total: progress("reference", done / total), conserving=conserving,
    )  # fmt: skip
    return xyz, "D65"


def method_map(relief: Relief, length_m: float | None, arguments, progress: Progress) -> np.ndarray:
    """Map (size, size, 3) in XYZ by one of METHODS."""
    settings = Settings(
        coherence_length_m=length_m,
        terms=arguments.terms,
        step_m=arguments.step_nm * 1e-9,
        dtype=np.dtype(arguments.precision).type,
        centred=arguments.centred,
        period_m=period_of(arguments),
    )
    method = METHODS[arguments.method](relief, settings)
    return brdf_map.from_method(
        method, arguments.size, np.radians(arguments.theta_i),
        tick=lambda done, total: progress(arguments.method, done / total),
    )  # fmt: skip


def period_of(arguments) -> float | None:
    """--period-nm in metres."""
    if arguments.period_nm is None:
        return None
    if not 10 <= arguments.period_nm <= 1e6:
        raise GratingError(f"--period-nm {arguments.period_nm:g}: not a grating's period; give 10 to 1e6")
    return arguments.period_nm * 1e-9


def run_evaluate(arguments) -> None:
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
            found[name] = evaluation.compare_bake(relief, settings, theta_i, around_m).as_dict()
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
        write_whole(arguments.output, lambda path: evaluation.plot(path, plotted, title))
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


def run_efficiency(arguments) -> None:
    """The `efficiency` verb."""
    found = efficiency.efficiencies(
        arguments.profile, arguments.period_um * 1e-6, arguments.depth_nm * 1e-9, arguments.wavelength_nm * 1e-9,
        np.radians(arguments.theta_i), arguments.orders, arguments.samples,
    )  # fmt: skip
    lines = [f"{o.order:+3d}  computed {o.computed:.9f}  analytic {o.analytic:.9f}  error {o.error:.1e}" for o in found]
    emit({"orders": [o.as_dict() for o in found]}, arguments.json, lambda: "\n".join(lines))


def run_benchmark(arguments) -> None:
    """The `benchmark` verb: the table, the page and its pictures."""
    if arguments.shared is not None and not arguments.shared.is_dir():
        raise GratingError(f"{arguments.shared}: there is no such folder; leave --shared out for the sample surfaces")
    plots.pyplot()
    effort = benchmark.QUICK if arguments.quick else benchmark.FULL
    facts = benchmark.run(effort, arguments.shared or benchmark.SHARED, Progress(arguments.progress))
    pictures = benchmark_page.write_pictures(facts, arguments.output / "images")
    page = arguments.output / benchmark_page.PAGE
    write_whole(page, lambda path: path.write_text(benchmark_page.text(facts), encoding="utf-8"))
    facts["files"] = [str(page), *map(str, pictures)]
    emit(facts, arguments.json, lambda: "\n".join([benchmark_page.summary(facts), *facts["files"]]))


def existing_bake(file: str) -> Path | None:
    """The bake that FILE names: an .exr, or a folder that holds exactly one (and what belongs to it)."""
    path = Path(file)
    if path.suffix.lower() == ".exr":
        return path
    if path.is_dir():
        pictures = set(path.glob("*.exr"))
        found = sorted(pictures - {lobes.path_beside(picture) for picture in pictures})
        if len(found) == 1:
            return found[0]
        if len(found) > 1:
            raise GratingError(f"{path}: holds {len(found)} bakes; name one of {', '.join(f.name for f in found)}")
    return None


def write_picture(path: Path, xyz: np.ndarray, illuminant: str) -> None:
    """PNG, or EXR of linear Rec.709."""
    if path.suffix.lower() == ".png":
        from PIL import Image

        write_whole(path, Image.fromarray(brdf_map.picture(xyz, illuminant)).save)
        return
    import OpenEXR

    rgb = np.nan_to_num(brdf_map.linear_rgb(xyz, illuminant))[::-1].astype(np.float32)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGB": np.ascontiguousarray(rgb)}) as file:
        write_whole(path, lambda temporary: file.write(str(temporary)))


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Have `write` make a file under a temporary name, and rename it once it is whole."""
    temporary = path.with_name(f".{path.stem}.partial{path.suffix}")
    try:
        write(temporary)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def height_map_of(arguments, file: str | None = None) -> HeightMap:
    """The height map that the command line names, or one of several."""
    return read_height_map(file or arguments.file, arguments.size_um, arguments.height_nm, arguments.channel)


def check_targets(arguments) -> None:
    """Refuse, before any work, what could not be written after it."""
    if arguments.json and arguments.json != "-":
        _check_file(Path(arguments.json))
        if not Path(arguments.json).parent.is_dir():
            raise GratingError(f"{arguments.json}: its folder is not there; make it first")
    output = getattr(arguments, "output", None)
    if output is not None and arguments.run is run_map:
        _check_file(output)
    existing = next((each for each in (output, *output.parents) if each.exists()), None) if output else None
    if existing is not None and existing != output and not existing.is_dir():
        raise GratingError(f"{existing}: is a file; name a folder")
    if (
        output is not None
        and arguments.run in (run_bake, run_dft, run_benchmark)
        and output.exists()
        and not output.is_dir()
    ):
        raise GratingError(f"{output}: is a file; name a folder")


def _check_file(path: Path) -> None:
    if path.is_dir():
        raise GratingError(f"{path}: is a folder; name a file")
    if path.parent.exists() and not path.parent.is_dir():
        raise GratingError(f"{path.parent}: is a file; name a folder")


def emit(facts: dict, target: str | None, summary) -> None:
    """Facts as JSON to a file or standard output, or a summary for people."""
    if target == "-":
        print(json.dumps(facts, indent=1))
    else:
        if target:
            Path(target).write_text(json.dumps(facts, indent=1) + "\n")
        print(summary())
