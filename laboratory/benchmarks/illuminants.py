# SPDX-License-Identifier: GPL-3.0-or-later
"""A lamp's own bake beside daylight's bake in the lamp's colour, each against sums at 1 nm.

    ./dev bench illuminants [--surfaces sample:cd sample:elaphe] [--pairs 300] [--json FILE|-]

Each surface is baked under D65 and under each of sixteen lamps, at a coherence of 12 um. The colours of a scene's lamp
are the bake's times the lamp's linear RGB. "Bradford" is the lamp's bake with white adapted by Bradford's. The
truth is the sum, at each nanometre, of the lamp's spectrum times the surface's, beside daylight as white. All are
clipped to Rec.709. Directions are drawn as for the self-check at four values of w, and exposed so that the 95th
percentile of the truth's luminance is 1; those below 0.002 do not count. Errors are CIEDE2000, median / 95th,
and the signed error of the luminance's sum before the clipping.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from precompute.bake.ensemble import bake, plan
from precompute.bake.request import BakeRequest
from precompute.bake.self_check import pairs_within, w_within
from precompute.cli.option_types import count
from precompute.cli.parser import OneLineParser
from precompute.colour.difference import delta_e_2000, lab
from precompute.colour.illuminants import spectrum
from precompute.colour.observer import observer, wavelengths, white_xyz
from precompute.colour.working_space import adapted_matrix, lamp_rgb, rgb_from_xyz
from precompute.measure.pairs import Pairs
from precompute.spectra.density import density_at
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import Relief, prepare
from precompute.table.table import Table

from .report import add_json, say, write

LAMPS = (
    *(f"{kelvins}K" for kelvins in (2000, 2400, 2700, 3200, 4000, 5000, 6500, 10000)),
    *("D5500", "D7500", "LED-B1", "LED-B3", "LED-RGB1", "FL2", "FL11", "HP1"),
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
        say(
            f"| {surface}: lamp | daylight's bake, dE00 | luminance | Bradford, dE00 | own bake, dE00 | luminance |",
            arguments.json,
        )
        say("| --- | --- | --- | --- | --- | --- |", arguments.json)
        facts[surface] = []
        for row in rows_of(prepare(read_height_map(surface)), arguments.pairs):
            facts[surface].append(row)
            say(
                "| {lamp} | {daylight[p50]:.1f} / {daylight[p95]:.1f} | {daylight[light]:+.1%} "
                "| {bradford[p50]:.1f} / {bradford[p95]:.1f} "
                "| {own[p50]:.1f} / {own[p95]:.1f} | {own[light]:+.1%} |".format(**row),
                arguments.json,
            )
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
    daylight = bake([relief], request)
    for lamp in lamps:
        own = bake([relief], BakeRequest(coherence_length_m=_COHERENCE_M, illuminant=lamp))
        bradford = adapted_matrix("Rec.709", white_xyz(lamp))
        yield {
            "lamp": lamp,
            "daylight": errors(seen, daylight, lamp, to_rgb=rgb_from_xyz()),
            "bradford": errors(seen, own, lamp, to_rgb=bradford),
            "own": errors(seen, own, lamp, to_rgb=rgb_from_xyz("Rec.709", lamp)),
        }


def errors(seen: Sequence[Seen], table: Table, lamp: str, *, to_rgb: np.ndarray) -> dict[str, float]:
    """The errors of a table's colours, by a matrix from XYZ to RGB, times a lamp's colour."""
    to_lamp = lamp_rgb("Rec.709", lamp)[:, None] * to_rgb
    weights = _weights_at_each_nanometre(lamp)
    true, found = [], []
    for each in seen:
        factor = each.pairs.radiance_factor(holds_reflectance=table.holds_reflectance)[:, None]
        true.append(factor * each.density.T @ weights / each.w**2 @ rgb_from_xyz().T)
        found.append(factor * table.candidate(each.pairs.u, each.pairs.v, each.w)[0] @ to_lamp.T)
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
