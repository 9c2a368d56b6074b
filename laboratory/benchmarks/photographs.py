# SPDX-License-Identifier: GPL-3.0-or-later
"""White beams on shed skins, photographed for M. Single's thesis, against the light that bakes of the scans predict.

    ./dev bench photographs [--output docs] [--shared DIR] [--json FILE|-]

The photographs and the scans are in the folder --shared, by default shared/data beside the repository. Without them the
benchmark says so and stops. The same code measures where the hues lie in a photograph and in the computed picture of
the same experiment. The thesis gives no scale, so only ratios of distances count. Each photograph is compared twice,
because it does not show which way round the skin lay, and again with the skin spread over directions. With --output,
the page against_the_world.md is written with its pictures, and sheets with the photographs to OUTPUT/thesis_comparison,
which is not committed.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.cli.parser import OneLineParser
from precompute.colour.spaces import srgb_encode
from precompute.surface.relief import prepare
from precompute.table.table import Table

from ..speed.surfaces import SHARED, skin
from ..study.pages import filled, table
from . import report
from .photographs_compared import (
    ELAPHE,
    XENOPELTIS,
    Comparison,
    Photograph,
    brightnesses,
    compared,
    named,
    read,
    rebalanced,
)
from .photographs_screen import Laboratory

PAGE = "against_the_world.md"
# Incidence, and the screen's turn. The thesis draws 45 degrees, and does not know the angle of the photographs.
DRAWN = (45.0, 0.0)
_LABORATORIES = (
    (35.0, 0.0), (40.0, 0.0), DRAWN, (50.0, 0.0), (45.0, -10.0), (45.0, -5.0), (45.0, 5.0), (45.0, 10.0),
)  # fmt: skip
# The computed pictures show their orders brighter than they are measured, as burnt as in the photographs.
_BRIGHTER = 4.0
# Standard deviations, in degrees, of the directions in which the skins lie; chosen by eye, so that the first orders are
# as wide across as in the photographs.
_SPREAD_DEG = {ELAPHE.skin: 2.0, XENOPELTIS.skin: 4.0}
# Rays are what a mean over so many degrees along a ring takes out, seen at this w and at this distance from the beam.
_RAY_DEG, _RAY_W, _RAY_AT = 10, 1.5, 0.2

Ways = tuple[Comparison, Comparison]


@dataclass(frozen=True)
class Row:
    """A ratio of distances in a photograph, and in our pictures of the skin both ways round.

    spread   relative standard deviation among the photograph's slabs; its tilt counts, too
    balance  relative change by a camera with 10 % more red, and by one with 10 % more blue, as a root of squares"""

    skin: str
    ratio: str
    photographed: float
    spread: float
    balance: float
    predicted: tuple[float, float]

    @property
    def differences(self) -> tuple[float, ...]:
        """Relative differences of the predictions."""
        return tuple(one / self.photographed - 1 for one in self.predicted)


@dataclass(frozen=True)
class Brightness:
    """Luminance of each hue over that of green in an unburnt band: of the photograph, and of the skin both ways."""

    skin: str
    band: str
    photographed: dict[str, float]
    predicted: tuple[dict[str, float], dict[str, float]]


@dataclass(frozen=True)
class Fit:
    """How well a laboratory fits: rms differences of the ratios of one hue, for the skin both ways round."""

    skin: str
    angle_deg: float
    turn_deg: float
    rms: tuple[float, float]


@dataclass(frozen=True)
class Spread:
    """A skin that lies in one direction, or is spread over directions.

    rms   of the ratios of one hue, for the skin both ways round
    rays  standard deviation of the rays' luminance over that of the ring"""

    skin: str
    spread_deg: float
    rms: tuple[float, float]
    rays: float


def rays_of(baked: Table) -> float:
    """The contrast of a table's rays: see Spread."""
    degrees = np.arange(0, 360, 0.5)
    u, v = _RAY_AT * np.cos(np.radians(degrees)), _RAY_AT * np.sin(np.radians(degrees))
    light = baked.scattered_over_w2(u, v, _RAY_W)[:, 1]
    kernel = np.exp(-0.5 * (np.minimum(degrees, 360 - degrees) / _RAY_DEG) ** 2)
    smooth = np.fft.irfft(np.fft.rfft(light) * np.fft.rfft(kernel / kernel.sum()), len(light))
    return float(np.sqrt(np.mean((light / smooth - 1) ** 2)))


def both_ways(baked: Table, photograph: np.ndarray, one: Photograph, laboratory: tuple[float, float] = DRAWN) -> Ways:
    """The comparisons with the skin as it was scanned, and turned by half a turn."""
    angle, turn = laboratory
    first, second = (
        compared(baked, photograph, one, Laboratory(along_b=one.along_b, reversed=way, angle_deg=angle, turn_deg=turn))
        for way in (False, True)
    )
    return first, second


def rows_of(photograph: np.ndarray, one: Photograph, ways: Ways) -> Iterator[Row]:
    """The ratios that the photograph and both pictures show."""
    places = ways[0].photographed
    others = [Comparison(places, photograph, changed) for changed in rebalanced(photograph, one)]
    for ratio in one.ratios:
        (theirs, first), (_, second) = (way.ratio(ratio) for way in ways)
        if np.isnan([theirs, first, second]).any():
            continue
        spread = np.hypot(*(np.nanstd(places[key]) / np.nanmean(places[key]) for key in ratio))
        balance = np.hypot(*(changed / plain - 1 for plain, changed in (other.ratio(ratio) for other in others)))
        yield Row(one.skin, named(ratio), theirs, float(spread), float(balance), (first, second))


def brightness_of(photograph: np.ndarray, one: Photograph, ways: Ways) -> Iterator[Brightness]:
    """The brightness of the hues in the photograph's unburnt bands."""
    pictures = [(photograph, ways[0].photographed), *((way.light, way.predicted) for way in ways)]
    theirs, first, second = (brightnesses(light, one, places) for light, places in pictures)
    for band in one.unburnt:
        yield Brightness(one.skin, band, theirs[band], (first[band], second[band]))


def rms_of(comparison: Comparison, one: Photograph) -> float:
    """The root mean square of the relative differences of the ratios of one hue."""
    ratios = [comparison.ratio(ratio) for ratio in one.ratios if ratio[0][1] == ratio[1][1]]
    return float(np.sqrt(np.nanmean([np.log(ours / theirs) ** 2 for theirs, ours in ratios])))


def tables(
    rows: list[Row], brightness: list[Brightness], fits: list[Fit], spreads: list[Spread]
) -> dict[str, str]:  # fmt: skip
    """The page's tables by name."""
    ways = ["as scanned", "half a turn"]
    return {
        "ratios": table(
            ["skin", "ratio", "photograph", "among rows", "white balance", *ways],
            [
                [row.skin, row.ratio, f"{row.photographed:.3f}", f"{row.spread:.1%}", f"{row.balance:.1%}"]
                + [f"{one:.3f} ({off:+.1%})" for one, off in zip(row.predicted, row.differences, strict=True)]
                for row in rows
            ],
        ),
        "laboratories": table(
            ["skin", "incidence", "screen turned by", *ways],
            [
                [fit.skin, f"{fit.angle_deg:.0f}", f"{fit.turn_deg:.0f}", *(f"{rms:.1%}" for rms in fit.rms)]
                for fit in fits
            ],
        ),
        "spreads": table(
            ["skin", "spread", *ways, "rays"],
            [
                [one.skin, f"{one.spread_deg:g} degrees", *(f"{rms:.1%}" for rms in one.rms), f"{one.rays:.0%}"]
                for one in spreads
            ],
        ),
        "brightness": table(
            ["skin", "band", "hue", "photograph", *ways],
            [
                [one.skin, one.band, hue, f"{theirs:.2f}", *(f"{ours[hue]:.2f}" for ours in one.predicted)]
                for one in brightness
                for hue, theirs in one.photographed.items()
                if hue != "green"
            ],
        ),
    }  # fmt: skip


def shown(light: np.ndarray) -> Image.Image:
    """Linear light as a picture."""
    return Image.fromarray(np.rint(srgb_encode(light) * 255).astype(np.uint8))


def write_pictures(folder: Path, photograph: np.ndarray, name: str, ways: Ways) -> None:
    """Write our two pictures of a skin, one above the other, and a sheet with the photograph above them."""
    for kind in ("images", "thesis_comparison"):
        (folder / kind).mkdir(parents=True, exist_ok=True)
    ours = _BRIGHTER * np.concatenate([way.light for way in ways])
    shown(ours).save(folder / "images" / f"beam_on_{name}.jpg", quality=88)
    shown(np.concatenate([photograph, ours])).save(folder / "thesis_comparison" / f"beam_on_{name}.png")


def main(argv: list[str] | None = None) -> None:
    """Compare both photographs and print the tables."""
    parser = OneLineParser(prog="./dev bench photographs", description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, metavar="DIR", help=f"write {PAGE} and its pictures")
    parser.add_argument("--shared", type=Path, default=SHARED, metavar="DIR")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    figures = arguments.shared / "thesis_figures"
    if not (figures / f"{ELAPHE.name}.png").is_file() or not (arguments.shared / "snake").is_dir():
        report.say(f"skipped: {arguments.shared} lacks the photographs or the scans", arguments.json)
        return
    rows, brightness, fits, spreads = [], [], [], []
    for one in (ELAPHE, XENOPELTIS):
        relief, photograph = prepare(skin(arguments.shared, one.skin)), read(figures, one)
        baked, spread = (bake(relief, BakeRequest(spread_deg=degrees)) for degrees in (None, _SPREAD_DEG[one.skin]))
        ways = both_ways(baked, photograph, one)
        rows += rows_of(photograph, one, ways)
        brightness += brightness_of(photograph, one, ways)
        for laboratory in _LABORATORIES:
            tried = both_ways(baked, photograph, one, laboratory)
            first, second = (rms_of(way, one) for way in tried)
            fits.append(Fit(one.skin, *laboratory, (first, second)))
        spread_ways = both_ways(spread, photograph, one)
        for degrees, table_of, seen in ((0.0, baked, ways), (_SPREAD_DEG[one.skin], spread, spread_ways)):
            first, second = (rms_of(way, one) for way in seen)
            spreads.append(Spread(one.skin, degrees, (first, second), rays_of(table_of)))
        if arguments.output:
            write_pictures(arguments.output, photograph, one.skin, ways)
            write_pictures(arguments.output, photograph, f"{one.skin}_spread", spread_ways)
    told = tables(rows, brightness, fits, spreads)
    report.say("\n\n".join(told.values()), arguments.json)
    if arguments.output:
        (arguments.output / PAGE).write_text(filled(PAGE, told), encoding="utf-8")
    facts = {"rows": rows, "brightness": brightness, "laboratories": fits, "spreads": spreads}
    report.write({name: [asdict(one) for one in some] for name, some in facts.items()}, arguments.json)


if __name__ == "__main__":
    main()
