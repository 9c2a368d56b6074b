# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's evaluation done again: this command makes docs/evaluation.md with all its pictures and numbers.

    ./dev bench evaluation [--output docs] [--shared DIR] [--json FILE|-]

DIR is the folder of real scans, by default shared/data beside the repository. Where it exists, the scans of Elaphe and
Xenopeltis are used, and our maps are held against the thesis's. Where it does not exist, sample surfaces take the place
of the scans.
"""

import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

from precompute.bake.ensemble import plan
from precompute.cli.parser import OneLineParser
from precompute.colour.observer import wavelengths
from precompute.maps import brdf_map
from precompute.methods.method import Settings
from precompute.methods.method_registry import METHODS
from precompute.surface.height_map import HeightMap
from precompute.surface.quality import grating_period
from precompute.surface.relief import Relief, prepare
from precompute.surface.samples.ruled_gratings import blazed

from ..speed.surfaces import SKINS
from ..study import evaluation, slits, terms
from ..study.colour_comparison import compare_bake
from ..study.pages import write_page
from ..study.response import WINDOW, FirstOrder, first_order_plane, response
from ..study.traits import DEFAULT_METHODS
from . import evaluation_page, report
from .evaluation_maps import PIXELS, Map, agreements, as_the_thesis_cuts, flss_about_mean, groups, height_maps, reliefs

THETA_I = np.radians(75)
# The thesis's own periods of the skins.
THESIS_PERIODS_M = {"elaphe": 1144.26e-9, "xenopeltis": 1552.27e-9}


@dataclass(frozen=True)
class Row:
    """One line of a table: an evaluation, and the mean and variance in nm that the thesis gives, if it does."""

    label: str
    evaluation: evaluation.Evaluation
    thesis: str = ""


def blaze_rows(surface: HeightMap) -> list[Row]:
    """The rows of the blaze: every method, and FLSS with light from the other side."""
    thesis = {"flss": "2499.997 / 0.377", "nmm": "2499.997 / 0.377"}
    relief, other = prepare(surface), prepare(evaluation.turned(surface, 0))
    settings, first_order = evaluation.thesis_settings(period_m=2.5e-6), FirstOrder(THETA_I, 2.5e-6)
    rows = [
        Row(name, evaluation.evaluate_method(name, relief, settings, first_order=first_order), thesis.get(name, ""))
        for name in DEFAULT_METHODS
    ]
    texels = replace(settings, texels=21)
    rows += [
        Row(
            "pq, 21 x 21 texels",
            evaluation.evaluate_method("pq", prepare(blazed(rows=64)), texels, first_order=first_order),
            "2502.428 / 0.390",
        ),
        Row("flss, light from +T", evaluation.evaluate_method("flss", other, settings, first_order=first_order)),
    ]
    return rows  # fmt: skip


def elaphe_rows(surface: HeightMap) -> list[Row]:
    """The rows of Elaphe: every method, then variations.

    The variations show how the period depends on the speckle of one patch and on the way the patch is cut out."""
    relief, other = prepare(surface), prepare(evaluation.turned(surface, 0))
    cut = as_the_thesis_cuts(evaluation.turned(surface, 0))
    period_m, given_m = grating_period(relief), THESIS_PERIODS_M["elaphe"]
    return [
        *(_row(name, name, relief, period_m) for name in DEFAULT_METHODS),
        _row("nmm, given 1144.26 nm", "nmm", relief, given_m),
        _row("flss, light from +T", "flss", other, period_m),
        _row("flss, cut as the thesis, from +T", "flss", cut, given_m, "1144.262 / 0.401"),
        _row("nmm, cut as the thesis, from +T", "nmm", cut, given_m, "1144.179 / 0.677"),
        _row("pq-printed, cut as the thesis, from +T", "pq-printed", cut, given_m, "1052.308 / 49.7"),
        _row("pq, cut as the thesis, from +T", "pq", cut, given_m),
        _row("reference, 30 areas", "reference", relief, period_m, coherence_length_m=None),
        _row("reference, 30 areas, from +T", "reference", other, period_m, coherence_length_m=None),
    ]


def xenopeltis_rows(surface: HeightMap) -> list[Row]:
    """The rows of Xenopeltis: every method in the plane along the fingers, then variations.

    The Taylor series is summed in float64, because float32 leaves it no digits at 819 nm of relief. Its heights count
    from the middle, which halves the number of its terms."""
    period_m, thesis = THESIS_PERIODS_M["xenopeltis"], "1552.27 / 0.45"
    relief, other = (prepare(evaluation.turned(surface, azimuth)) for azimuth in (90, 270))
    cut, other_cut = (as_the_thesis_cuts(evaluation.turned(surface, azimuth)) for azimuth in (90, 270))

    def row(label: str, name: str, what: Relief, **changes) -> Row:
        told = thesis if name == "flss" else ""
        return _row(label, name, what, period_m, told, **{"dtype": np.float64, "centred": True, **changes})

    return [
        *(row(name, name, relief) for name in DEFAULT_METHODS if name != "stam"),
        row("flss, light from -B", "flss", other),
        row("flss, cut as the thesis, from +B", "flss", cut),
        row("flss, cut as the thesis, from -B", "flss", other_cut),
        row("reference, 30 areas", "reference", relief, coherence_length_m=None),
        row("reference, 30 areas, from -B", "reference", other, coherence_length_m=None),
    ]


def _row(label: str, name: str, relief: Relief, period_m: float, thesis: str = "", **changes) -> Row:
    """A method under the thesis's settings and these changes, given a period and evaluated around it."""
    settings, first_order = evaluation.thesis_settings(period_m=period_m, **changes), FirstOrder(THETA_I, period_m)
    return Row(label, evaluation.evaluate_method(name, relief, settings, first_order=first_order), thesis)


def grid_variance(surface: HeightMap, step_deg: float) -> float:
    """Variance of the period in square nanometres on the blaze when each peak is the highest sample of a grid of
    angles.

    The thesis takes its peaks so."""
    relief, lambdas = prepare(surface), wavelengths(5e-9)
    plane = first_order_plane(THETA_I, lambdas, 2.5e-6, step=np.radians(step_deg))
    method = METHODS["chebyshev"](relief, evaluation.thesis_settings())
    order = np.abs(plane.u) * 2.5e-6 / lambdas[:, None]
    found = response(method, plane, lambdas) * (np.abs(order - 1) < WINDOW)
    return float(np.var(lambdas / np.abs(plane.u[found.argmax(axis=1)]) * 1e9))


def patch_spread(surface: HeightMap, around_m: float, parts: int = 3) -> list[float]:
    """The periods in nanometres that FLSS over Chebyshev images finds in each of parts x parts pieces of a scan, around
    a period in metres.

    Each piece is 65 / parts um long."""
    rows, cols = (n // parts for n in surface.height_m.shape)
    found = []
    for k in range(parts * parts):
        y, x = (k // parts) * rows, (k % parts) * cols
        piece = replace(surface, height_m=surface.height_m[y : y + rows, x : x + cols], periodic=False)
        relief = prepare(piece)
        settings = evaluation.thesis_settings(coherence_length_m=relief.size_m[1])
        one = evaluation.evaluate_method("chebyshev", relief, settings, first_order=FirstOrder(THETA_I, around_m))
        found.append(one.as_dict()["period_mean_nm"])
    return found


ROOT = Path(__file__).resolve().parents[2]
MAP_METHODS = {**METHODS, "flss-about-mean": flss_about_mean}


def draw_maps(wanted: dict[str, list[Map]], reliefs: dict[str, Relief], folder: Path, target: str | None) -> None:
    """Write every map; a method that is asked for several pictures is built once."""
    built = {}
    for one in (one for group in wanted.values() for one in group):
        started = time.perf_counter()
        relief = reliefs[one.surface]
        wi = brdf_map.light_from(np.radians(one.theta_i_deg))
        if one.method == "reference":
            sigma_b = plan(relief).sigma_b
            # In Stam's form, as the methods beside it.
            xyz = brdf_map.from_reference(relief, sigma_b, PIXELS, wi=wi, seen=brdf_map.seen_colour(5e-9), stam=True)
        else:
            key = one.surface, one.method, tuple(one.changes.items())
            if key not in built:
                built = {key: MAP_METHODS[one.method](relief, Settings(**one.changes))}
            xyz = brdf_map.from_method(built[key], PIXELS, wi)
        picture = brdf_map.picture(xyz, percentile=one.percentile)
        Image.fromarray(coarser(picture)).save(folder / f"{one.name}.png", optimize=True)
        report.say(f"  {one.name}: {time.perf_counter() - started:.1f} s", target)


def coarser(picture: np.ndarray) -> np.ndarray:
    """A picture with its 8-bit values in steps of 4, which no eye sees in speckle. The files are a third smaller."""
    return np.minimum(np.rint(picture / 4) * 4, 255).astype(np.uint8)


def save_small(picture: Image.Image, path: Path) -> None:
    """Write a plot in a palette of 255 colours, a third of the bytes. A map would show the palette."""
    picture.convert("RGB").quantize(255, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE).save(path, optimize=True)


def main(argv: list[str] | None = None) -> None:
    """Compute everything and write the page."""
    parser = OneLineParser(prog="./dev bench evaluation", description="Makes docs/evaluation.md.")
    parser.add_argument("--output", type=Path, default=ROOT / "docs", metavar="DIR")
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared" / "data", metavar="DIR")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    started = time.perf_counter()
    images = arguments.output / "images" / "evaluation"
    images.mkdir(parents=True, exist_ok=True)
    surfaces = height_maps(arguments.shared)

    tables = {
        "blaze": blaze_rows(surfaces["blaze"]),
        "elaphe": elaphe_rows(surfaces["elaphe"]),
        "xenopeltis": xenopeltis_rows(surfaces["xenopeltis"]),
    }
    bakes = {}
    for name, rows in tables.items():
        azimuth = 90 if name == "xenopeltis" else 180
        relief = prepare(evaluation.turned(surfaces[name], azimuth))
        bakes[name] = compare_bake(relief, Settings(), FirstOrder(THETA_I, rows[0].evaluation.expected_m))
        plain = [row.evaluation for row in rows if row.label in METHODS]
        plot = images / f"response-{name}.png"
        evaluation.plot(plot, plain)
        save_small(Image.open(plot), plot)
        report.say(f"  {name} evaluated, {time.perf_counter() - started:.0f} s", arguments.json)
    wanted = groups()
    draw_maps(wanted, reliefs(surfaces), images, arguments.json)
    facts = evaluation_page.Facts(
        scan=not any(surfaces[name].source.startswith("sample:") for name in SKINS),
        tables=tables,
        bakes=bakes,
        grid_variance=grid_variance(surfaces["blaze"], 0.017),
        patches={
            "elaphe": patch_spread(surfaces["elaphe"], THESIS_PERIODS_M["elaphe"]),
            "xenopeltis": patch_spread(evaluation.turned(surfaces["xenopeltis"], 90), THESIS_PERIODS_M["xenopeltis"]),
        },
        terms=terms.table(),
        agreements=agreements(wanted, images, arguments.shared),
    )
    terms.plot(images / "terms.png")
    save_small(Image.open(images / "terms.png"), images / "terms.png")
    slits.plot(images / "slits.png")
    write_page(arguments.output, "evaluation.md", evaluation_page.text(facts, wanted))
    seconds = time.perf_counter() - started
    report.say(f"{arguments.output / 'evaluation.md'}: {seconds:.0f} s", arguments.json)
    report.write({**facts.as_dict(), "seconds": seconds}, arguments.json)
