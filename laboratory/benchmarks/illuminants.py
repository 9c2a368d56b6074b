# SPDX-License-Identifier: GPL-3.0-or-later
"""A lamp's colours by bakes with three, six and nine channels and by its own bake, each against sums at 1 nm.

    ./dev bench illuminants [--surfaces sample:cd sample:elaphe] [--pairs 300] [--json FILE|-]

Each surface is baked under D65, D65+smooth, D65+led and each of sixteen lamps, at a coherence of 12 um. "As it was" is
daylight's bake times the linear RGB of a scene's lamp. Six and nine channels are multiplied by the lamp's matrix. The
truth is the sum, at each nanometre, of the lamp's spectrum times the surface's, beside daylight as white. All are
clipped to Rec.709. Directions are drawn as for the self-check at four values of w, and exposed so that the 95th
percentile of the truth's luminance is 1; those below 0.002 do not count. Errors are CIEDE2000, median / 95th,
and the signed error of the luminance's sum before the clipping.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from precompute.bake.ensemble import bake, plan
from precompute.bake.request import BakeRequest
from precompute.bake.self_check import pairs_within, w_within
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.colour.channels import scene_matrix
from precompute.colour.illuminants import spectrum
from precompute.colour.observer import observer, wavelengths, white_xyz
from precompute.colour.spaces import delta_e_2000, lab, lamp_rgb, rgb_from_xyz
from precompute.measure.errors import Pairs
from precompute.spectra.density import density_at
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import Relief, prepare
from precompute.table.table import Table

from .report import add_json, say, write

LAMPS = (
    *(f"{kelvins}K" for kelvins in (2000, 2400, 2700, 3200, 4000, 5000, 6500, 10000)),
    *("D5500", "D7500", "LED-B1", "LED-B3", "LED-RGB1", "FL2", "FL11", "HP1"),
)
# The bakes for all lamps: the name of their figures, the illuminant, and the title of their columns.
BAKES = (
    ("three", "D65", "as it was"),
    ("six", "D65+smooth", "six channels"),
    ("nine", "D65+led", "nine channels"),
)
_COHERENCE_M = 12e-6
_GROUPS, _DARK = 4, 0.002


@dataclass(frozen=True)
class Seen:
    """Direction pairs of one w, and the light that a surface scatters there at each nanometre (401, n)."""

    w: float
    pairs: Pairs
    density: np.ndarray


def main(argv: list[str] | None = None) -> int:
    """Print the table."""
    parser = OneLineParser(prog="./dev bench illuminants", description=__doc__.splitlines()[0])
    parser.add_argument("--surfaces", nargs="+", default=["sample:cd", "sample:elaphe"], metavar="FILE")
    parser.add_argument("--pairs", type=count(20, 4000), default=300, help="direction pairs at each w; default 300")
    add_json(parser)
    arguments = parser.parse_args(argv)
    facts: dict[str, list[dict[str, Any]]] = {}
    for surface in arguments.surfaces:
        titles = [*(title for *_, title in BAKES), "own bake"]
        heads = (f"{title}, dE00 | luminance" for title in titles)
        say(f"| {' | '.join([f'{surface}: lamp', *heads])} |", arguments.json)
        say("| --- " * (1 + 2 * len(titles)) + "|", arguments.json)
        facts[surface] = []
        for row in rows_of(prepare(read_height_map(surface)), arguments.pairs):
            facts[surface].append(row)
            figures = (row[name] for name in (*(name for name, *_ in BAKES), "own"))
            cells = (f"{each['p50']:.1f} / {each['p95']:.1f} | {each['light']:+.1%}" for each in figures)
            say(f"| {' | '.join([row['lamp'], *cells])} |", arguments.json)
    write(facts, arguments.json)
    return 0


def rows_of(relief: Relief, pairs: int, lamps: Sequence[str] = LAMPS) -> Iterator[dict[str, Any]]:
    """Yield the figures of each lamp on a relief."""
    request = BakeRequest(coherence_length_m=_COHERENCE_M)
    chosen = plan([relief], request)
    rng = np.random.default_rng(3)
    seen = []
    for w in w_within(chosen.w_range, _GROUPS, rng):
        drawn = pairs_within(chosen, w, pairs, rng=rng)
        density = density_at(chosen.ensemble[0], drawn.u, drawn.v, w=w, lambdas=wavelengths(1e-9), sigma=chosen.sigma_b)
        seen.append(Seen(float(w), drawn, density))
    held = {name: bake([relief], replace(request, illuminant=illuminant)) for name, illuminant, _ in BAKES}
    for lamp in lamps:
        own = bake([relief], replace(request, illuminant=lamp))
        by_channels = {name: errors(seen, table, lamp) for name, table in held.items()}
        yield {"lamp": lamp, **by_channels, "own": errors(seen, own, lamp)}


def errors(seen: Sequence[Seen], table: Table, lamp: str) -> dict[str, float]:
    """The errors of a table's colours under a lamp: its channels times the lamp's matrix and the lamp's colour."""
    to_rgb = rgb_from_xyz() if table.illuminant == "D65" else scene_matrix("Rec.709", table.illuminant, lamp)
    to_lamp = lamp_rgb("Rec.709", lamp)[:, None] * to_rgb
    weights = _weights_at_each_nanometre(lamp)
    true, found = [], []
    for each in seen:
        factor = each.pairs.radiance_factor(ratio_ior=table.ratio_ior)[:, None]
        true.append(factor * each.density.T @ weights / each.w**2 @ rgb_from_xyz().T)
        found.append(factor * table.channels_over_w2(each.pairs.u, each.pairs.v, each.w) @ to_lamp.T)
    return _compared(np.concatenate(true), np.concatenate(found))


def _weights_at_each_nanometre(lamp: str) -> np.ndarray:
    """Weights (401, 3) by the rectangle rule, without the bake's code for the spectrum between wavelengths."""
    nm = wavelengths(1e-9) * 1e9
    weights = observer(nm * 1e-9, "E") * np.interp(nm, *spectrum(lamp))[:, None]
    return weights / weights[:, 1].sum()


def _compared(true: np.ndarray, found: np.ndarray) -> dict[str, float]:
    to_xyz = np.linalg.inv(rgb_from_xyz()).T
    luminance = true @ to_xyz[:, 1]
    scale = 1 / np.percentile(luminance, 95)
    counted = scale * luminance >= _DARK
    labs = [lab(np.maximum(scale * each[counted], 0) @ to_xyz, white_xyz()) for each in (true, found)]
    off = delta_e_2000(*labs)
    return {
        "p50": float(np.median(off)),
        "p95": float(np.percentile(off, 95)),
        "light": float((found @ to_xyz[:, 1]).sum() / luminance.sum() - 1),
    }
