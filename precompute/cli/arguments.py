# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments that several verbs share, and the types of their values for argparse.

Python parses `nan`, `1e-308`, `1_000` and the digits of every script as numbers. The types here accept only plain
decimal numbers, within the range that makes sense for the option."""

import argparse
import contextlib
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from ..bake.request import COHERENCE_UM, DELTA_E, HEIGHT_NM, MODELS, PATCH_UM, SIZE_UM, SPREAD_DEG
from ..base.failure import GratingError
from ..colour.illuminants import LAMPS, OWN_MAX, illuminant_of, lamp_of
from ..reflectance.films import METALS
from ..reflectance.matter import Matter, parse
from ..render_job.plan import parse_frames
from ..surface.generated.kinds import KINDS
from ..surface.height_map import HeightMap
from ..surface.readers.reader_registry import read_height_map
from ..surface.steps.pipeline import help_text, parse_steps
from ..surface.steps.step import Step
from ..table.sample_set import path_beside

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.ASCII | re.IGNORECASE)
_COUNT = re.compile(r"[+-]?\d+", re.ASCII)
# The greatest length of a number's text.
_LONGEST = 40


def number(low: float, high: float) -> Callable[[str], float]:
    """The type of an option that takes a number from low to high."""

    def read(text: str) -> float:
        if len(text) <= _LONGEST and _NUMBER.fullmatch(text) and low <= float(text) <= high:
            return float(text)
        raise argparse.ArgumentTypeError(f"{_shown(text)}: give a number from {low:g} to {high:g}")

    return read


def count(low: int, high: int) -> Callable[[str], int]:
    """The type of an option that takes a whole number from low to high."""

    def read(text: str) -> int:
        if len(text) <= _LONGEST and _COUNT.fullmatch(text) and low <= int(text) <= high:
            return int(text)
        raise argparse.ArgumentTypeError(f"{_shown(text)}: give a whole number from {low} to {high}")

    return read


def name_argument(text: str) -> str:
    """Parse the name of a file or of a channel."""
    if not text:
        raise argparse.ArgumentTypeError("is empty; give a name")
    return text


def path_argument(text: str) -> Path:
    """Parse a path."""
    return Path(name_argument(text))


def frames_argument(text: str) -> tuple[int, ...]:
    """Parse ranges of frames, such as 1-24:2,30."""
    try:
        return parse_frames(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{_shown(str(error))}: give ranges such as 1-24:2,30") from error


def _shown(text: str) -> str:
    return repr(text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}...")


def add_input(parser: argparse.ArgumentParser, several: str | None = None) -> None:
    """Add FILE, the options for the size of a picture and the channel of an instrument's file, and --json.

    `several` is argparse's `nargs` for verbs that take more than one FILE."""
    text = f"height map, or sample:NAME ({', '.join(sample_names())}), or grating:KIND?NAME=VALUE&NAME=VALUE "
    text += f"({', '.join(KINDS)})"
    if several:
        parser.add_argument(
            "files",
            nargs=several,
            type=name_argument,
            metavar="FILE",
            help=text + "; several scans of the same skin are averaged",
        )
    else:
        parser.add_argument("file", type=name_argument, metavar="FILE", help=text)
    parser.add_argument(
        "--size-um",
        type=number(*SIZE_UM),
        metavar="W",
        help="width of the scan in micrometres (pictures; replaces the width in another file)",
    )
    parser.add_argument(
        "--height-nm", type=number(*HEIGHT_NM), metavar="H",
        help="height in nanometres: from black to white (pictures), or of the number 1 (1e9 for numbers in metres)",
    )  # fmt: skip
    parser.add_argument("--channel", type=name_argument, help="which of the file's channels, by name")
    add_json(parser)
    add_progress(parser)


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add --json."""
    parser.add_argument("--json", type=name_argument, metavar="FILE|-", help="write the result as JSON")


def add_progress(parser: argparse.ArgumentParser) -> None:
    """Add --progress, the style in which a verb reports its progress on standard error. Programs set it."""
    parser.add_argument("--progress", choices=("text", "json", "none"), default="text", help=argparse.SUPPRESS)


def add_bake_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of a bake. An option that is not given is None: a request and a preset have their own values."""
    parser.add_argument(
        "--delta-e",
        type=number(*DELTA_E),
        metavar="DE",
        help="limit of the colour error (99th percentile of CIEDE2000) under small lamps; default 1",
    )
    parser.add_argument(
        "--coherence-um", type=coherence_argument, metavar="auto|UM",
        help="coherence length at 550 nm, 4 sigma; with auto, the scan averages at least 30 coherence areas",
    )  # fmt: skip
    parser.add_argument(
        "--model", choices=MODELS,
        help="model of coherence: the mean over all places of a window, or the thesis's one patch under one window, "
        "whose coherence length is 65 um unless given; default ensemble",
    )  # fmt: skip
    add_patch(parser, "the patch model's window")
    parser.add_argument(
        "--spread-deg", type=number(*SPREAD_DEG), metavar="DEG",
        help="average over copies of the skin, turned by random angles of this standard deviation. It averages rays "
        "that the speckle of one scan makes, and widens orders along rings; default: one direction",
    )  # fmt: skip
    parser.add_argument(
        "--needs", type=path_argument, metavar="NEEDS.json",
        help="bake only the directions that a scene shows; in Blender the verb `needs` writes this file",
    )  # fmt: skip
    parser.add_argument(
        "--illuminant", "--spectra", type=illuminant_argument, metavar="LIGHT",
        help="the light on the surface, whose own spectrum makes the colours: an illuminant of the CIE (D65, E, A, C, "
        "D50, FL1 to FL12, HP1 to HP5, LED-B1, ...), a black body as 2700K, daylight as D5500, a laser's line as "
        f"532nm, a lamp ({', '.join(LAMPS)}), or a file of wavelengths in nm and powers; default D65. For a scene with "
        "several lamps: smooth holds the colours under daylight and black bodies, led also those under LEDs, and "
        f"smooth+tube or led+FL11+532nm also those under up to {OWN_MAX} further lamps",
    )  # fmt: skip
    parser.add_argument(
        "--matter", type=matter_argument, metavar="MATTER",
        help="what the surface is made of: dielectric (skin, plastic, glass), mirror, a metal "
        f"({', '.join(METALS)}), or layers from the outside inwards on a substrate, such as '1.46/200nm, aluminium' or "
        "'6x(1.68/80nm, 1.56/90nm), 1.56'; default dielectric",
    )  # fmt: skip
    add_level(parser, "plane", None)
    parser.add_argument("--no-cache", action="store_true", help="bake even if the cache has this bake")


def add_patch(parser: argparse.ArgumentParser, of: str) -> None:
    """Add --patch-um, the centre of the window `of` what the help says."""
    parser.add_argument(
        "--patch-um", type=place_argument, metavar="X,Y",
        help=f"centre of {of}, in micrometres to the right and upwards from the lower left corner of the levelled "
        "scan; default its middle",
    )  # fmt: skip


def place_argument(text: str) -> tuple[float, float]:
    """Parse a place on a scan, in micrometres."""
    parts = text.split(",")
    if len(parts) != 2:
        raise argparse.ArgumentTypeError(f"{text:.40}: give two numbers, as 20,32.5")
    x, y = map(number(*PATCH_UM), parts)
    return x, y


def matter_argument(text: str) -> Matter:
    """Parse a matter."""
    with _as_argument():
        return parse(text)


def add_level(parser: argparse.ArgumentParser, default: str, steps: tuple[Step, ...] | None = ()) -> None:
    """Add --level. Its default is `steps`, which `default` describes in words; None if the verb chooses it."""
    parser.add_argument(
        "--level", type=level_argument, default=steps, metavar="STEP,STEP",
        help=f"steps that level and repair the scan, in the order given, or none; default {default}. {help_text()}",
    )  # fmt: skip


def level_argument(text: str) -> tuple[Step, ...]:
    """Parse levelling steps."""
    with _as_argument():
        return parse_steps(text, f"{text:.40}")


@contextlib.contextmanager
def _as_argument() -> Iterator[None]:
    """Turn the error of a text into one that argparse reports with its option."""
    try:
        yield
    except GratingError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def sample_names() -> tuple[str, ...]:
    """The names for `sample:NAME`."""
    from ..surface.samples.catalogue import SAMPLES

    return tuple(SAMPLES)


def illuminant_argument(text: str) -> str:
    """Parse an illuminant, or read its file."""
    with _as_argument():
        return illuminant_of(text)


def lamp_argument(text: str) -> str:
    """Parse one lamp, or read its file."""
    with _as_argument():
        return lamp_of(text)


def coherence_argument(text: str) -> float | None:
    """Parse a coherence length in micrometres; None for "auto"."""
    return None if text == "auto" else number(*COHERENCE_UM)(text)


# Shared option types: a wavelength step in nanometres, a number of terms, a grating's period in nanometres.
STEP_NM, TERMS, PERIOD_NM = number(0.1, 100), count(1, 1000), number(10, 1e6)


def period_of(arguments: argparse.Namespace) -> float | None:
    """--period-nm in metres, or None."""
    return None if arguments.period_nm is None else arguments.period_nm * 1e-9


def existing_bake(file: str) -> Path | None:
    """The bake that FILE names, or None if FILE names something else.

    FILE is an .exr, or a folder with exactly one bake, with or without its sample set. Raises GratingError if the
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
            raise GratingError(path, f"holds {len(found)} bakes", f"name one of {', '.join(f.name for f in found)}")
    return None


def height_map_of(arguments: argparse.Namespace, file: str | None = None) -> HeightMap:
    """Read the height map of `file`, by default the command line's only FILE. Raises GratingError as read_height_map
    does."""
    return read_height_map(file or arguments.file, arguments.size_um, arguments.height_nm, channel=arguments.channel)


@contextlib.contextmanager
def naming(file: str) -> Iterator[None]:
    """Add `file` to the message of a GratingError inside, unless the message begins with it."""
    try:
        yield
    except GratingError as error:
        if str(error.what).startswith(file):
            raise
        raise error.within(file) from error
