# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures a bake under wider kernels, which large lamps and rough surfaces read from its blur levels."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..measure.errors import Errors, Truth, measure
from ..measure.pairs import Pairs, pair_about
from ..optics.plate import least_cosine
from ..optics.region import FARTHEST
from .table_file import Table

# The least number of direction pairs under each kernel, over all values of w, and at one w.
_PAIRS, _PAIRS_AT_W = 160, 24
# Where a table ends within the sky, the light beyond is unknown. Pairs keep this many standard deviations away from it.
_FROM_RIM = 3.0


@dataclass(frozen=True)
class Wide:
    """The errors under one kernel: `level` is its place between the blur levels, `sigma` its standard deviation."""

    level: float
    sigma: float
    errors: Errors

    def as_dict(self) -> dict[str, Any]:
        """Convert to JSON."""
        told = self.errors.as_dict()
        return {
            "level": self.level,
            "sigma": self.sigma,
            **{name: told[name] for name in ("p95", "p99", "p99_most", "relative_dy", "pairs")},
        }


def levels_of(table: Table) -> list[float]:
    """The wider levels, and the middles between two levels."""
    return [half / 2 for half in range(1, 2 * len(table.wider) + 1)]


def sigma_at(table: Table, level: float) -> float:
    """The standard deviation of the kernel at a place between the levels."""
    return table.sigma_b * math.sqrt(table.grown(level))


def pairs_under(table: Table, first: Pairs, w: float, *, groups: int, rng: np.random.Generator) -> list[Pairs]:
    """Direction pairs of one w of `groups` for each of levels_of, from the pairs of the first level.

    Half are cosine weighted. The others are at places that follow the spectrum, moved by what the kernel adds."""
    half = max(_PAIRS_AT_W, math.ceil(_PAIRS / groups)) // 2
    cosine, lit = np.flatnonzero(~first.drawn), np.flatnonzero(first.drawn)
    found = []
    for level in levels_of(table):
        sigma = sigma_at(table, level)
        uv = np.column_stack([first.u, first.v])[rng.choice(lit, half) if len(lit) else lit]
        uv += math.sqrt(sigma**2 - table.sigma_b**2) * rng.standard_normal(uv.shape)
        uv = uv[np.sum(uv**2, axis=1) < FARTHEST**2 - w**2]
        spectral = pair_about(
            np.column_stack([uv, np.full(len(uv), w)]), rng, least=least_cosine(table.matter.plate_ior)
        )
        plain = first.only(rng.permutation(cosine)[:half])
        wi, wr = (np.concatenate(ways) for ways in zip((plain.wi, plain.wr), spectral, strict=True))
        pairs = Pairs(wi, wr, np.arange(len(wi)) >= len(plain.wi))
        found.append(pairs.within(table.region.known(_FROM_RIM * sigma)))
    return found


def measured_under(table: Table, truths: Sequence[Sequence[Truth]]) -> list[Wide]:
    """The errors under each of levels_of, from each level's truths. A level without a pair is left out."""
    found = []
    for level, of_level in zip(levels_of(table), truths, strict=True):
        if any(len(truth.pairs.wi) for truth in of_level):
            sigma = sigma_at(table, level)
            found.append(Wide(level, sigma, _measured(table, list(of_level), sigma)))
    return found


def _measured(table: Table, truths: list[Truth], sigma: float) -> Errors:
    variance = sigma**2 - table.sigma_b**2

    def candidate(u: np.ndarray, v: np.ndarray, w: float) -> tuple[np.ndarray, np.ndarray]:
        return table.scattered_over_w2(u, v, w, variance=variance), table.zero_order_xyz(w)

    return measure(truths, candidate, table.illuminant, ratio_ior=table.ratio_ior)


def claimed(record: dict[str, Any]) -> float:
    """The dE00 that a bake's header claims under wider kernels; infinite without a claim."""
    told = record.get("delta_e")
    found = told.get("wide_p99_most") if isinstance(told, dict) else None
    return float(found) if isinstance(found, (int, float)) else math.inf
