# SPDX-License-Identifier: GPL-3.0-or-later
"""The checks' truth: the ensemble model's radiance by direct sums, also under the wider kernels of the blur levels.

This file shares no code with the reference or the bake, except the relief (levelled, filled, refined and apodised) and
the observer's tables. The spectra of the relief are sums over every pixel (table_file.py). Large lamps and rough
surfaces read the blur levels, so a bake is measured under their kernels too."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from precompute.base.progress import Progress, silent
from precompute.colour.channels import channel_weights
from precompute.colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, observer, seen_wavelengths
from precompute.measure.errors import Errors, Pairs, Truth, cosine_weighted, measure, pair_about
from precompute.optics.plate import least_cosine
from precompute.optics.region import FARTHEST, Region
from precompute.reflectance.matter import MIRRORING, Matter
from precompute.surface.relief import Relief

from .table_file import KERNEL_REACH, Table, scattered_cells

# Number of bands of wavelength, all of the same luminance, in which half vectors are drawn.
_DRAWN_AT = 12
# Number of classes of heights. On a relief of 2 um, a class spans 0.02 radians; the mean phasor is off by 1e-5.
_HEIGHT_CLASSES = 4096


def scattered_xyz(
    reliefs: Sequence[Relief], uvw: tuple[np.ndarray, np.ndarray, float], *, sigma_b: float | np.ndarray, step_m: float,
    illuminant: str = "D65", matter: Matter = MIRRORING, progress: Progress = silent,
) -> np.ndarray:  # fmt: skip
    """Scattered XYZ (n, 3) at the places u and v (n,), all at one w, by the mean of the reliefs' spectra. For several
    illuminants joined by "+", XYZ under each follows (n, 3 parts), at the wavelengths that the first is seen at.

    It is the density over (u, v) of the light that a surface of a matter and of the obliquity O = 1 reflects, scaled so
    that a perfect mirror's white has Y = 1. `sigma_b`, a number or (n,), is the kernel's standard deviation. The
    narrowest kernel spaces the cells. `progress` is called after each wavelength of each relief."""
    count = int(np.ceil((WAVELENGTH_MAX_M - WAVELENGTH_MIN_M) / step_m - 1e-6))
    lambdas = seen_wavelengths(np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, count + 1), illuminant)
    weights = channel_weights(lambdas, illuminant) / len(reliefs)
    u, v, w = uvw
    reflectance = matter.reflectance(lambdas, np.minimum(np.sqrt(u**2 + v**2 + w**2) / 2, 1))
    sigmas = np.broadcast_to(np.asarray(sigma_b, float), u.shape)
    narrowest = float(sigmas.min(initial=1.0))
    narrow = sigmas == narrowest
    reach = [_reach(places, sigmas, narrowest) for places in (v, u)]
    found = np.zeros((len(u), weights.shape[1]))
    for n, relief in enumerate(reliefs):
        for k, (lam, weight) in enumerate(zip(lambdas, weights, strict=True)):
            cells = scattered_cells(relief, w / lam, (reach[0] / lam, reach[1] / lam), sigma_q=narrowest / lam)
            density = np.empty(len(u))
            density[narrow] = cells.density(u[narrow], v[narrow], lam, sigma_b=narrowest)
            if not narrow.all():
                density[~narrow] = cells.wide_density(
                    u[~narrow], v[~narrow], lam, sigma=sigmas[~narrow], farthest=FARTHEST / matter.plate_ior
                )
            found += (density * reflectance[k])[:, None] * weight
            progress("check", (n + (k + 1) / len(lambdas)) / len(reliefs))
    return found


def _reach(places: np.ndarray, sigmas: np.ndarray, narrowest: float) -> float:
    """The largest |u| or |v| from which kernels of `sigmas` (n,) bring light to places (n,). Those wider than the
    narrowest bring none from beyond FARTHEST."""
    own = np.abs(places) + KERNEL_REACH * sigmas
    return float(np.where(sigmas > narrowest, np.minimum(own, FARTHEST), own).max(initial=0.0))


def zero_order_xyz(
    reliefs: Sequence[Relief], w: np.ndarray, illuminant: str = "D65", *, matter: Matter = MIRRORING
) -> np.ndarray:
    """The zero order's XYZ (n, 3) at w (n,), the mean over the reliefs, in wavelength steps of 1 nm; for several parts,
    all channels (n, channels)."""
    lambdas = at_each_nanometre(illuminant)
    efficiency = sum(zero_order_efficiency(relief, w, lambdas) for relief in reliefs)
    efficiency = efficiency * matter.reflectance(lambdas, np.asarray(w) / 2).T
    return efficiency @ channel_weights(lambdas, illuminant) / len(reliefs)


def at_each_nanometre(illuminant: str) -> np.ndarray:
    """The wavelengths (n,) in metres of zero_order_xyz."""
    return seen_wavelengths(np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, 401), illuminant)


def zero_order_efficiency(relief: Relief, w: np.ndarray, lambdas: np.ndarray) -> np.ndarray:
    """A relief's efficiency in the zero order (n, m) at w (n,) and wavelengths (m,) in metres: the squared modulus of
    the characteristic function of its heights."""
    height, share = _distribution(relief)
    return np.stack([np.abs(np.exp(-2j * np.pi * each / lambdas[:, None] * height) @ share) ** 2 for each in w])


def _distribution(relief: Relief) -> tuple[np.ndarray, np.ndarray]:
    """The heights of a relief in classes: mean heights (n,) of the non-empty classes, and their shares (n,) of the
    surface, weighted by the squared apodisation."""
    weight = (relief.apodisation**2).ravel()
    height = relief.height_m.ravel()
    width = max(relief.height_range_m / _HEIGHT_CLASSES, np.finfo(float).tiny)
    index = np.minimum(((height - height.min()) / width).astype(int), _HEIGHT_CLASSES - 1)
    share = np.bincount(index, weight)
    mean = np.bincount(index, weight * height)[share > 0] / share[share > 0]
    return mean, share[share > 0] / weight.sum()


@dataclass(frozen=True)
class Held:
    """The directions that a table holds, and its light.

    sigma_b  standard deviation of the kernel in u and v
    region   of u and v
    least    the least cosine of both directions
    line_m   the wavelength of a laser's line in metres; None for white light"""

    sigma_b: float
    region: Region
    least: float = 0.0
    line_m: float | None = None


def draw_pairs(reliefs: Sequence[Relief], held: Held, w: float, *, count: int, rng: np.random.Generator) -> Pairs:
    """Draw up to `count` direction pairs with cos(ti) + cos(tr) = w among those that a table holds.

    Half of the pairs are cosine weighted, and half are drawn from the spectrum. Fewer are returned if pairs rarely fall
    in the region."""
    cosine = _cosine_within(w, count // 2, held, rng)
    half = _half_vectors(reliefs, w, count - count // 2, held, rng)
    wi, wr = pair_about(half, rng, least=held.least)
    drawn = np.arange(len(cosine.wi) + len(wi)) >= len(cosine.wi)
    return Pairs(np.concatenate([cosine.wi, wi]), np.concatenate([cosine.wr, wr]), drawn)


def _cosine_within(w: float, count: int, held: Held, rng: np.random.Generator) -> Pairs:
    wi, wr = np.empty((2, 0, 3))
    for _ in range(100):
        more = cosine_weighted(w, count, rng, least=held.least)
        kept = Pairs(*more, np.zeros(len(more[0]), bool)).within(held.region)
        wi, wr = np.concatenate([wi, kept.wi])[:count], np.concatenate([wr, kept.wr])[:count]
        if len(wi) == count:
            break
    return Pairs(wi, wr, np.zeros(len(wi), bool))


def _half_vectors(reliefs: Sequence[Relief], w: float, count: int, held: Held, rng: np.random.Generator) -> np.ndarray:
    """Draw up to `count` half vectors (n, 3) from the scattered power times luminance, blurred by the kernel."""
    region, sigma_b, line_m = held.region, held.sigma_b, held.line_m
    nm = np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, 401)
    luminance = np.cumsum(observer(nm)[:, 1])
    # Twice `count` half vectors are drawn, because the kernel moves some of them past the horizon.
    each = -(-2 * count // (_DRAWN_AT * len(reliefs)))
    radius = np.sqrt(4 - w**2)
    found = [np.empty((0, 2))]
    for k in range(_DRAWN_AT):
        at = np.append((k + rng.random(each)) / _DRAWN_AT, (k + 0.5) / _DRAWN_AT)
        *lambdas, middle = np.interp(at * luminance[-1], luminance, nm) if line_m is None else np.full(at.shape, line_m)
        for relief in reliefs:
            cells = scattered_cells(relief, w / middle, (radius / middle, radius / middle), sigma_q=sigma_b / middle)
            u, v = middle * cells.q_x, middle * cells.q_y[:, None]
            inside = region.contains(u, v)
            cumulative = np.cumsum(cells.power * (inside & (u**2 + v**2 < radius**2)))
            if cumulative[-1] > 0:
                bins = np.searchsorted(cumulative, rng.random(each) * cumulative[-1], side="right")
                row, col = np.unravel_index(np.minimum(bins, cumulative.size - 1), cells.power.shape)
                q = np.column_stack([cells.q_x[col], cells.q_y[row]])
                found.append(np.array(lambdas)[:, None] * q + sigma_b * rng.standard_normal((each, 2)))
    uv = rng.permutation(np.concatenate(found))
    uv = uv[region.contains(uv[:, 0], uv[:, 1]) & (np.sum(uv**2, axis=1) < radius**2)][:count]
    return np.column_stack([uv, np.full(len(uv), w)])


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
