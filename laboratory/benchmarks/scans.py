# SPDX-License-Identifier: GPL-3.0-or-later
"""How removing dust and scars changes the bakes of the two real skins: docs/scans.md with its figures and pictures.

    ./dev bench scans [--output FILE.md] [--delta-e DE] [--json FILE|-]

Each scan is baked as it is, with only a plane removed, and repaired. The difference of two bakes is the CIEDE2000
between their colours on the same direction pairs, by the metric that compares a bake with its reference.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from precompute.bake.make import Made, make
from precompute.bake.request import DELTA_E, BakeRequest
from precompute.cli.arguments import number
from precompute.cli.parser import OneLineParser
from precompute.maps import brdf_map
from precompute.measure.errors import Errors, Truth, draw_w, measure
from precompute.measure.truths import draw_pairs, exact_spectrum
from precompute.reference.reference import reference_grid
from precompute.surface.height_map import HeightMap
from precompute.surface.quality import describe
from precompute.surface.relief import Relief, relief_of
from precompute.surface.steps.pipeline import Levelled, level, parse_steps

from ..speed.surfaces import SHARED, SKINS, skin
from . import report, scans_page

PLAIN = "plane"
REPAIRED = ("plane,scars,dust", "plane,scars,dust:4")
# Values of w, and direction pairs at each.
W_COUNT, PAIRS = 4, 1500
# The map's light is at 30 degrees, as in the thesis; its size is in pixels. The cut-out's side is in micrometres.
THETA_I, MAP_PIXELS, CUT_UM = np.radians(30), 320, 13.0
_SEED = 1


@dataclass(frozen=True)
class Baked:
    """A scan after levelling steps, and its bake."""

    steps: str
    levelled: Levelled
    relief: Relief
    made: Made

    @property
    def holes(self) -> np.ndarray:
        """The pixels (rows, cols) that the steps removed."""
        return np.isnan(self.levelled.height_map.height_m)


def baked(scan: HeightMap, steps: str, request: BakeRequest) -> Baked:
    """Bake a scan after steps."""
    levelled = level(scan, parse_steps(steps))
    relief = relief_of(levelled.height_map)
    return Baked(steps, levelled, relief, make([relief], request, source=scan.source))


def difference(plain: Baked, other: Baked) -> Errors:
    """The colours of another bake compared with the plain one's, on directions drawn from the plain one's spectrum.

    Both have the same coherence, as both scans have the same size."""
    table = plain.made.table
    rng = np.random.default_rng(_SEED)
    grid = reference_grid(plain.relief, table.sigma_b)
    truth = []
    for w in draw_w(W_COUNT, rng):
        pairs = draw_pairs(exact_spectrum(plain.relief, grid), table.sigma_b, w, count=PAIRS, rng=rng)
        scattered, zero_order = table.candidate(pairs.u, pairs.v, w)
        truth.append(Truth(w, pairs, scattered * w**2, zero_order))
    return measure(truth, other.made.table.candidate)


def picture(plain: Baked, other: Baked) -> Image.Image:
    """The square where most was removed: as scanned, with the removed pixels in red, filled; then both bakes' maps."""
    part = around_most(other.holes, plain.levelled.height_map)
    before, after = (each.relief.height_m[::-1] for each in (plain, other))
    before, after = (_of_pixels(each, plain.levelled.height_map)[part] for each in (before, after))
    low, high = np.percentile(before, [0.5, 99.5])
    greys = [np.rint(255 * np.clip((each - low) / (high - low), 0, 1)).astype(np.uint8) for each in (before, after)]
    marked = np.where(other.holes[part][..., None], np.array([220, 30, 30], np.uint8), greys[0][..., None])
    tiles = [Image.fromarray(each).convert("RGB") for each in (greys[0], marked.astype(np.uint8), greys[1])]
    tiles = [each.resize((MAP_PIXELS, MAP_PIXELS), Image.Resampling.BICUBIC) for each in tiles]
    maps = [brdf_map.from_bake(each.made.table, MAP_PIXELS, brdf_map.light_from(THETA_I)) for each in (plain, other)]
    tiles += [Image.fromarray(brdf_map.picture(each)) for each in maps]
    sheet = Image.new("RGB", (len(tiles) * (MAP_PIXELS + 8) - 8, MAP_PIXELS), "white")
    for index, tile in enumerate(tiles):
        sheet.paste(tile, (index * (MAP_PIXELS + 8), 0))
    return sheet


def _of_pixels(height: np.ndarray, scan: HeightMap) -> np.ndarray:
    """A relief's heights at the scan's own pixels; the relief may have been refined."""
    factors = [fine // coarse for fine, coarse in zip(height.shape, scan.height_m.shape, strict=True)]
    return height[factors[0] // 2 :: factors[0], factors[1] // 2 :: factors[1]]


def around_most(holes: np.ndarray, scan: HeightMap) -> tuple[slice, slice]:
    """A square of CUT_UM that holds the most removed pixels, centred on them unless they lie near the scan's edge."""
    sides = [min(n, round(CUT_UM * 1e-6 / pixel)) for n, pixel in zip(holes.shape, scan.pixel_size_m, strict=True)]
    total = np.pad(holes.astype(int).cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    inside = total[sides[0] :, sides[1] :] - total[: -sides[0], sides[1] :]
    inside += total[: -sides[0], : -sides[1]] - total[sides[0] :, : -sides[1]]
    # Several squares may hold the same removed pixels; the middle one has them at its centre.
    most = np.argwhere(inside == inside.max())
    row, col = np.rint(most.mean(axis=0)).astype(int)
    return slice(row, row + sides[0]), slice(col, col + sides[1])


def facts_of(plain: Baked, other: Baked) -> dict:
    """The figures of a repaired bake compared with the plain one, as JSON."""
    found = difference(plain, other)
    return {
        "steps": other.steps,
        "told": list(other.levelled.told),
        "removed": float(other.holes.mean()),
        "height_range_m": other.relief.height_range_m,
        "rms_m": float(np.std(other.relief.height_m)),
        "terms": other.made.layout.terms,
        "blender_bytes": other.made.blender_bytes,
        "own_p99": other.made.errors.p99,
        "mean": found.mean,
        "p99": found.p99,
        "relative_dy": found.relative_dy,
    }


def measured(name: str, request: BakeRequest, pictures: Path | None) -> dict:
    """The figures of a skin. Its picture is written to `pictures`, unless this is None."""
    scan = skin(SHARED, name)
    plain = baked(scan, PLAIN, request)
    rows = [facts_of(plain, plain)]
    for steps in REPAIRED:
        other = baked(scan, steps, request)
        rows.append(facts_of(plain, other))
        # The picture shows the first steps that remove anything.
        if pictures is not None and other.holes.any():
            picture(plain, other).save(pictures / f"{name}.png", optimize=True)
            pictures = None
    return {"name": name, "quality": describe(scan).quality.in_words(), "rows": rows}


def main(argv: Sequence[str]) -> None:
    """Bake, measure, and write the page and its pictures."""
    parser = OneLineParser(prog="./dev bench scans", description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("docs", "scans.md"), metavar="FILE.md")
    parser.add_argument("--delta-e", type=number(*DELTA_E), default=1.0, metavar="DE", help="of the bakes; default 1")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    pictures = arguments.output.parent / "images" / "scans"
    pictures.mkdir(parents=True, exist_ok=True)
    skins = []
    for name in SKINS:
        skins.append(measured(name, BakeRequest(delta_e=arguments.delta_e), pictures))
        for row in skins[-1]["rows"]:
            report.say(f"{name:<12}{' | '.join(scans_page.cells_of(row))}", arguments.json)
    arguments.output.write_text(scans_page.page(skins, arguments.delta_e))
    report.write({"skins": skins}, arguments.json)
