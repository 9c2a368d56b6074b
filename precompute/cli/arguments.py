# SPDX-License-Identifier: GPL-3.0-or-later
"""The arguments that several verbs share."""

import argparse
from pathlib import Path

from ..bake.request import MODELS
from ..base.failure import GratingError
from ..colour.observer import ILLUMINANTS
from ..surface.height_map import HeightMap
from ..surface.readers.registry import read_height_map
from ..table.sample_set import path_beside


def add_input(parser: argparse.ArgumentParser, several: str | None = None) -> None:
    """Add FILE, the options that tell the size of a picture and the channel of an instrument's file, and --json.

    `several` is argparse's `nargs` for verbs that take more than one FILE."""
    text = "height map, or sample:NAME (" + ", ".join(sample_names()) + ")"
    if several:
        parser.add_argument(
            "files", nargs=several, metavar="FILE", help=text + "; several scans of the same skin are averaged"
        )
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
    """Add the options that steer a bake."""
    parser.add_argument(
        "--delta-e",
        type=float,
        default=1.0,
        metavar="DE",
        help="99th percentile of CIEDE2000 that the bake must keep; default 1",
    )
    parser.add_argument(
        "--coherence-um", type=coherence_argument, default=None, metavar="auto|UM",
        help="coherence length at 550 nm, 4 sigma; with auto, the scan averages at least 30 coherence areas",
    )  # fmt: skip
    parser.add_argument(
        "--model", choices=MODELS, default="ensemble",
        help="model of coherence: the mean over all places of a window, or the thesis's one patch under one window, "
        "whose coherence length is 65 um unless given; default ensemble",
    )  # fmt: skip
    parser.add_argument(
        "--needs", type=Path, metavar="NEEDS.json", help="bake only what a scene reaches (docs/needs.md)"
    )
    parser.add_argument("--illuminant", choices=ILLUMINANTS, default="D65", help="what counts as white; default D65")
    parser.add_argument("--no-cache", action="store_true", help="bake even if the cache has this bake")


def sample_names() -> tuple[str, ...]:
    """The names that `sample:NAME` takes."""
    from ..surface.samples.catalogue import SAMPLES

    return tuple(SAMPLES)


def coherence_argument(text: str) -> float | None:
    """A coherence length in micrometres; None for "auto". For argparse, whose error it raises for any other text."""
    if text == "auto":
        return None
    value = float(text)
    if not 0 < value < 1e4:
        raise argparse.ArgumentTypeError(f"{text} um is not a coherence length")
    return value


def check_sampling(arguments) -> None:
    """Raise GratingError if the wavelength step or the number of terms makes no sense."""
    if not 0.1 <= arguments.step_nm <= 100:
        raise GratingError(f"--step-nm {arguments.step_nm:g}: not a wavelength step; give 0.1 to 100")
    if arguments.terms is not None and not 1 <= arguments.terms <= 1000:
        raise GratingError(f"--terms {arguments.terms}: not a number of terms; give 1 to 1000")


def period_of(arguments) -> float | None:
    """--period-nm in metres, or None. Raises GratingError for a period that no grating has."""
    if arguments.period_nm is None:
        return None
    if not 10 <= arguments.period_nm <= 1e6:
        raise GratingError(f"--period-nm {arguments.period_nm:g}: not a grating's period; give 10 to 1e6")
    return arguments.period_nm * 1e-9


def existing_bake(file: str) -> Path | None:
    """The bake that FILE names, or None if FILE names something else.

    FILE is an .exr, or a folder with exactly one bake, whose sample set may stand beside it. Raises GratingError if the
    folder has several bakes."""
    path = Path(file)
    if path.suffix.lower() == ".exr":
        return path
    if path.is_dir():
        pictures = set(path.glob("*.exr"))
        found = sorted(pictures - {path_beside(picture) for picture in pictures})
        if len(found) == 1:
            return found[0]
        if len(found) > 1:
            raise GratingError(f"{path}: holds {len(found)} bakes; name one of {', '.join(f.name for f in found)}")
    return None


def height_map_of(arguments, file: str | None = None) -> HeightMap:
    """The height map of `file`, or without one of the command line's only FILE. Raises GratingError as read_height_map
    does."""
    return read_height_map(file or arguments.file, arguments.size_um, arguments.height_nm, channel=arguments.channel)
