# SPDX-License-Identifier: GPL-3.0-or-later
"""Blur between two levels of a table: how close the levels must be, and how best to mix their two values.

    ./dev bench levels [--surfaces sample:blazed sample:elaphe] [--growths 1.2 2 9] [--json FILE|-]

A surface's table at a coherence of 12 um gets levels of each of three variance ratios. The benchmark reads
it under kernels of `growth` times its own variance. It compares the result with sums over the bins of the same spectra
under the same kernel, by the project's error metric at w = 0.7 and 1.6. Two mixes of the two levels are compared.
"linear" is the product's: its weights give the mixture the right variance. "Gaussian" is exact for a lone order under
any kernel, I(s) = a exp(-r^2 / 2 s) / s for a variance s: log(s I) is linear in 1 / s, in each channel. Where orders
overlap it is too bright. `light` is the sum over all (u, v) at w = 1.2, relative to the sum without blur.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from precompute.bake import self_check
from precompute.bake.ensemble import carry_out, plan
from precompute.bake.levels_and_basis import with_levels
from precompute.bake.plan import Plan
from precompute.bake.request import BakeRequest
from precompute.base.progress import silent
from precompute.cli.arguments import number
from precompute.cli.parser import OneLineParser
from precompute.measure.errors import Truth, measure
from precompute.measure.truths import draw_pairs
from precompute.optics.region import Region
from precompute.surface.relief import prepare
from precompute.surface.samples.catalogue import SAMPLE_PREFIX, make_sample
from precompute.table.atlas import layout_of
from precompute.table.table import BYTES_PER_TEXEL, Spacing, Table, cell_for, level_mix

from . import report

COHERENCE_M = 12e-6
# Levels that are evenly apart.
TRIED = tuple(Spacing(ratio, 0.0) for ratio in (1.5, 2.0, 4.0))
GROWTHS = 1.22, 1.41, 1.84, 2.0, 2.4, 2.83, 5.6, 9.0
_W, _PAIRS = (0.7, 1.6), 600
# Pairs lie where no kernel of the growths reaches beyond the table's edge.
_REGION = Region((-1.5, 1.5), (-1.5, 1.5))

# mix(finer, coarser, variance relative to the finer level's, ratio)
Mix = Callable[[np.ndarray, np.ndarray, float, float], np.ndarray]


def linear(finer: np.ndarray, coarser: np.ndarray, grown: float, ratio: float) -> np.ndarray:
    """The mixture of two levels that has the given variance."""
    return finer + (coarser - finer) * ((grown - 1) / (ratio - 1))


def gaussian(finer: np.ndarray, coarser: np.ndarray, grown: float, ratio: float) -> np.ndarray:
    """The value of a lone Gaussian order between two levels; 0 where a level is not positive."""
    share = (1 - 1 / grown) / (1 - 1 / ratio)
    lit = np.minimum(finer, coarser) > 0
    below, above = (np.log(each, out=np.zeros_like(finer), where=lit) for each in (finer, coarser))
    return lit * np.exp(below + share * (above - below)) * (ratio**share / grown)


MIXES: dict[str, Mix] = {"linear": linear, "Gaussian": gaussian}


def read(table: Table, mix: Mix, growth: float, *places: np.ndarray | float) -> np.ndarray:
    """A table's XYZ / w^2 (n, 3) at u, v, w under `growth` times its kernel's variance."""
    ratio = table.spacing.ratio
    (level,), _ = level_mix(np.array([growth - 1]), len(table.levels), spacing=table.spacing)
    finer, coarser = (
        table.scattered_over_w2(*places, variance=(ratio**each - 1) * table.sigma_b**2) for each in (level, level + 1)
    )
    return mix(finer, coarser, growth / ratio**level, ratio)


def truths(chosen: Plan, growth: float, *, pairs: int = _PAIRS) -> list[Truth]:
    """The reference under `growth` times the kernel's variance, on direction pairs drawn from a plan's spectra."""
    rng, sigma, found = np.random.default_rng(3), chosen.sigma_b * growth**0.5, []
    for w in _W:
        drawn = draw_pairs(self_check._spectrum(chosen.ensemble, rng), sigma, w, count=pairs, rng=rng)
        wide = replace(chosen, sigma_b=sigma)
        found.extend(self_check._truths(wide, drawn.within(_REGION), w, ("D65",), "D65", silent))
    return found


def light(table: Table, mix: Mix, growth: float) -> float:
    """Luminance under a wider kernel, summed over all (u, v) at w = 1.2, relative to the table's own kernel."""
    axis = np.arange(-2, 2, table.sigma_b)
    u, v = (each.ravel() for each in np.meshgrid(axis, axis))
    whole = table.scattered_over_w2(u, v, 1.2)[:, 1].sum()
    return float(read(table, mix, growth, u, v, 1.2)[:, 1].sum() / whole)


def rows_of(source: str, growths: list[float]) -> list[dict]:
    """A row of one surface for each ratio, mix and growth."""
    chosen = plan(prepare(make_sample(source.removeprefix(SAMPLE_PREFIX))), BakeRequest(coherence_length_m=COHERENCE_M))
    table, rows = carry_out(chosen), []
    tables = {
        spacing.ratio: with_levels(table, cell_for(len(table.terms), table.inner, table.sigma_b, spacings=(spacing,)))
        for spacing in TRIED
    }
    for growth in growths:
        true = truths(chosen, growth)
        for ratio, one in tables.items():
            layout = layout_of(one)
            for name, mix in MIXES.items():

                def candidate(u, v, w, one=one, mix=mix, growth=growth):
                    return read(one, mix, growth, u, v, w), one.zero_order_xyz(w)

                errors = measure(true, candidate)
                rows.append({
                    "surface": source, "ratio": ratio, "mix": name, "growth": growth, "mean": errors.mean,
                    "p95": errors.p95, "p99": errors.p99, "max": errors.max, "relative_dy": errors.relative_dy,
                    "light": light(one, mix, growth),
                    "mebibytes": layout.width * layout.height * BYTES_PER_TEXEL / 2**20,
                })  # fmt: skip
    return rows


def as_text(rows: list[dict]) -> str:
    """The largest errors of each surface, ratio and mix over the growths."""
    lines = [f"{'surface':<16} {'ratio':>5} {'mix':<9} {'MiB':>6} {'p95':>6} {'p99':>6} {'max':>6} {'light':>15}"]
    for key in dict.fromkeys((row["surface"], row["ratio"], row["mix"]) for row in rows):
        own = [row for row in rows if (row["surface"], row["ratio"], row["mix"]) == key]
        p95, p99, most = (max(row[name] for row in own) for name in ("p95", "p99", "max"))
        lights = [row["light"] for row in own]
        lines.append(
            f"{key[0]:<16} {key[1]:>5g} {key[2]:<9} {own[0]['mebibytes']:>6.1f} {p95:>6.2f} {p99:>6.2f} {most:>6.2f}"
            f" {min(lights):>7.4f} {max(lights):>7.4f}"
        )
    return "\n".join(lines)


def main(argv: list[str] | None = None) -> None:
    """Print the largest errors and write the rows."""
    parser = OneLineParser(
        prog="./dev bench levels", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--surfaces", nargs="+", default=["sample:blazed", "sample:elaphe"], metavar="sample:NAME")
    parser.add_argument("--growths", nargs="+", type=number(0.1, 100), default=list(GROWTHS), metavar="FACTOR")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    rows = [row for source in arguments.surfaces for row in rows_of(source, arguments.growths)]
    report.say(as_text(rows), arguments.json)
    report.write({"coherence_um": COHERENCE_M * 1e6, "rows": rows}, arguments.json)


if __name__ == "__main__":
    main()
