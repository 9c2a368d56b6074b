# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's evaluation done again: this command makes docs/evaluation.md with all its pictures and numbers.

    ./dev bench evaluation [--output docs] [--shared DIR] [--json FILE|-]

DIR is the folder of real scans, by default shared/data beside the repository. Where it exists, the scans of Elaphe and
Xenopeltis are used, and our maps are held against the thesis's. Where it does not exist, sample surfaces take the place
of the scans.
"""

import time
from pathlib import Path

import numpy as np
from PIL import Image

from precompute.bake.ensemble import plan
from precompute.cli.parser import OneLineParser
from precompute.maps import brdf_map
from precompute.methods.method import Settings
from precompute.methods.method_registry import METHODS
from precompute.surface.relief import Relief, prepare

from ..speed.surfaces import SKINS
from ..study import evaluation, slits, terms
from ..study.colour_comparison import compare_bake
from ..study.response import FirstOrder
from . import evaluation_page, report
from .evaluation_maps import PIXELS, Map, flss_about_mean, groups, height_maps, reliefs
from .evaluation_rows import (
    THESIS_PERIODS_M,
    THETA_I,
    blaze_rows,
    elaphe_rows,
    grid_variance,
    patch_spread,
    xenopeltis_rows,
)

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
        agreements=evaluation_page.agreements(wanted, images, arguments.shared),
    )
    terms.plot(images / "terms.png")
    save_small(Image.open(images / "terms.png"), images / "terms.png")
    slits.plot(images / "slits.png")
    (arguments.output / "evaluation.md").write_text(evaluation_page.text(facts, wanted))
    seconds = time.perf_counter() - started
    report.say(f"{arguments.output / 'evaluation.md'}: {seconds:.0f} s", arguments.json)
    report.write({**facts.as_dict(), "seconds": seconds}, arguments.json)
