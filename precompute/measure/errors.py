# SPDX-License-Identifier: GPL-3.0-or-later
"""Error metrics (docs/theory.md), the same for every truth and candidate, and the direction pairs that they take.

A candidate is a bake or a method. The bake's self-check measures it against sums over its own spectra
(bake/self_check.py), under the patch model against precompute/reference, and laboratory/check against direct sums.

Colours are radiance under unit irradiance, with the BRDF's factor (optics/brdf.py). CIEDE2000 is computed at four
exposures, and the worst counts. The zero order is measured separately."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ..colour.observer import white_xyz
from ..colour.spaces import delta_e_2000, lab
from ..optics.brdf import NO_RATIO, scattering_factor
from ..optics.region import Region


@dataclass(frozen=True)
class Pairs:
    """Unit vectors wi, wr (n, 3) to light and viewer, of one w; `drawn` (n,) marks pairs from the truth's spectrum."""

    wi: np.ndarray
    wr: np.ndarray
    drawn: np.ndarray

    @property
    def u(self) -> np.ndarray:
        """(n,), the component of wi + wr along T."""
        return self.wi[:, 0] + self.wr[:, 0]

    @property
    def v(self) -> np.ndarray:
        """(n,), the component of wi + wr along B."""
        return self.wi[:, 1] + self.wr[:, 1]

    def within(self, region: Region) -> "Pairs":
        """The pairs whose u and v lie in a region."""
        return self.only(region.contains(self.u, self.v))

    def only(self, kept: np.ndarray | slice) -> "Pairs":
        """The pairs that a mask (n,), a list of indices or a slice keeps."""
        return Pairs(self.wi[kept], self.wr[kept], self.drawn[kept])

    def radiance_factor(self, *, ratio_ior: float = NO_RATIO) -> np.ndarray:
        """The factor (n,) that turns scattered XYZ over w^2 into radiance under unit irradiance: for keratin's index of
        refraction, or in the ratio form of `ratio_ior` for light that holds its reflectance."""
        return scattering_factor(self.wi, self.wr, ratio_ior=ratio_ior)


def draw_w(count: int, rng: np.random.Generator, *, least: float = 0.0) -> np.ndarray:
    """Draw values of w = cos(ti) + cos(tr), (count,), distributed as for two cosine-weighted directions whose cosines
    are at least `least`.

    One value comes from each of `count` quantiles, so that a few values cover the range."""
    sums = np.sort(np.sqrt(least**2 + (1 - least**2) * rng.random((4096, 2))).sum(axis=1))
    return sums[((np.arange(count) + rng.random(count)) / count * len(sums)).astype(int)]


def cosine_weighted(
    w: float, count: int, rng: np.random.Generator, *, least: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Draw unit vectors wi, wr (count, 3) with cos(ti) + cos(tr) = w, both cosine weighted, at random azimuths. Their
    cosines are at least `least`."""
    low, high = max(least, w - 1), min(1.0, w - least)
    candidates = rng.uniform(low, high, 64 * count)
    # The cosine c of a cosine-weighted direction has the density 2 c, and its partner's cosine is w - c. Their joint
    # density is proportional to c (w - c), which peaks at c = w / 2.
    kept = candidates[rng.random(len(candidates)) * (w / 2) ** 2 < candidates * (w - candidates)]
    ci = kept[:count]
    azimuth = rng.uniform(0, 2 * np.pi, (2, len(ci)))
    return _direction(ci, azimuth[0]), _direction(w - ci, azimuth[1])


def _direction(cosine: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    sine = np.sqrt(np.maximum(1 - cosine**2, 0))
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=-1)


def pair_about(half: np.ndarray, rng: np.random.Generator, *, least: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Draw unit vectors wi and wr whose sums wi + wr are the vectors `half` (n, 3). Their cosines are above `least`.

    A vector of `half` without a pair after 200 trials is left out, so fewer than n pairs may be returned."""
    wi, wr, _ = pair_and_kept(half, rng, least=least)
    return wi, wr


def pair_and_kept(
    half: np.ndarray, rng: np.random.Generator, *, least: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Like pair_about. Also returns the indices of the vectors of `half` that have a pair."""
    length = np.linalg.norm(half, axis=1, keepdims=True)
    axis = half / length
    side = np.cross(axis, np.where(np.abs(axis[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]]))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(axis, side)
    reach = np.sqrt(np.maximum(1 - length**2 / 4, 0))
    offset = np.zeros_like(half)
    pending = np.arange(len(half))
    for _ in range(200):
        turn = rng.uniform(0, 2 * np.pi, (len(pending), 1))
        trial = reach[pending] * (np.cos(turn) * side[pending] + np.sin(turn) * up[pending])
        above = np.abs(trial[:, 2]) < half[pending, 2] / 2 - least
        offset[pending[above]] = trial[above]
        pending = pending[~above]
        if len(pending) == 0:
            break
    kept = np.setdiff1d(np.arange(len(half)), pending)
    return (half / 2 + offset)[kept], (half / 2 - offset)[kept], kept


# The share of the light, |dY| / Y, that may be wrong if a dE00 of 1 or less is asked for; for more, it grows in
# proportion.
RELATIVE_DY = 0.01
EXPOSURE_PERCENTILES = (50, 90, 99, 99.9)
# A pair counts at an exposure if the Y of the reference or of the candidate is in this range.
COUNTED_Y = (0.002, 1.0)
# Radiance under unit irradiance below this is only rounding: phasors are exact to 1e-16, and power is their square.
_DARK_Y = 1e-15
# The allowance for the sampling of a percentile, in standard deviations.
_CONFIDENCE = 2
# candidate(u, v, w), with u and v (n,): its scattered XYZ over w^2 (n, 3), and its zero order's XYZ (3,).
Candidate = Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]]
# The fields of Errors that are differences of colour.
_COLOUR = ("mean", "p95", "p99", "max", "p95_of_w", "p99_of_w")
# The share of pairs above the 99th percentile.
_ABOVE = 0.01
# The least number of values of w whose spread is measured, and of pairs of one w whose percentiles are.
_GROUPS_MIN, _OF_W = 8, 100


@dataclass(frozen=True)
class Errors:
    """Error metrics of one candidate.

    mean, p95, p99, max  CIEDE2000 at the worst exposure
    relative_dy          sum of |dY| over the sum of Y
    relative_rms         rms of dY over the rms of Y
    zero_order_dy        largest |dY| of the zero order
    pairs                number of direction pairs
    share_deviation      standard deviation of the share of pairs below p99, by sampling; see the allowances
    p99_of_w             largest p99 of the pairs of one w, among values of w with at least _OF_W pairs; see `claim`
    p95_of_w             the same of p95
    """

    mean: float
    p95: float
    p99: float
    max: float
    relative_dy: float
    relative_rms: float
    zero_order_dy: float
    pairs: int
    share_deviation: float
    p99_of_w: float = 0.0
    p95_of_w: float = 0.0

    @property
    def p99_allowance(self) -> float:
        """The sampling error of the 99th percentile: two standard deviations.

        The standard deviation of the share of pairs below the percentile, divided by the probability density at the
        percentile, is the standard deviation of the estimate. The density is that of an exponential tail through p95
        and p99: 0.01 over (p99 - p95) / ln 5."""
        return self._tail * self.share_deviation / _ABOVE

    @property
    def p95_allowance(self) -> float:
        """The sampling error of the 95th percentile: two standard deviations.

        It follows as for the 99th. The variance of a share s is proportional to s (1 - s), for independent pairs and
        for pairs whose errors are as similar as those beside the 99th percentile."""
        share = 0.05
        ratio = math.sqrt(share * (1 - share) / (_ABOVE * (1 - _ABOVE)))
        return self._tail * self.share_deviation * ratio / share

    @property
    def _tail(self) -> float:
        """Two lengths over which an exponential tail through p95 and p99 falls to 1 / e."""
        return _CONFIDENCE * (self.p99 - self.p95) / math.log(5) if math.isfinite(self.p99) else 0.0

    @property
    def p99_most(self) -> float:
        """The 99th percentile plus its sampling error."""
        return self.p99 + self.p99_allowance

    @property
    def claim(self) -> float:
        """The dE00 that the 99th percentile keeps, however the values of w are distributed.

        The percentile of pairs of several w is at most the largest of each w alone."""
        return max(self.p99_most, self.p99_of_w)

    @property
    def p95_claim(self) -> float:
        """The dE00 that the 95th percentile keeps, however the values of w are distributed."""
        return max(self.p95 + self.p95_allowance, self.p95_of_w)

    def over(self, delta_e: float) -> float:
        """The error over a requested dE00: at most 1 if the request is kept.

        The 99th percentile is estimated from a sample of directions, so its sampling error is added."""
        return max(self.p99_most / delta_e, self.relative_dy / (RELATIVE_DY * max(delta_e, 1)))

    def as_dict(self) -> dict[str, float | None]:
        """Convert the errors to JSON, with p99_most; null stands for an infinite error (see `measure`)."""
        told = {**asdict(self), "p99_most": self.p99_most}
        return {name: value if math.isfinite(value) else None for name, value in told.items()}

    def worse_by(self, delta_e: float, relative: float) -> "Errors":
        """Add separately measured errors: delta_e to errors of colour, `relative` to relative errors of luminance."""
        colour = {name: getattr(self, name) + delta_e for name in _COLOUR}
        light = {name: getattr(self, name) + relative for name in ("relative_dy", "relative_rms")}
        return replace(self, **colour, **light)


@dataclass(frozen=True)
class Truth:
    """The reference at one w: direction pairs, their scattered XYZ (n, 3), and the zero order's XYZ (3,)."""

    w: float
    pairs: Pairs
    scattered_xyz: np.ndarray
    zero_order_xyz: np.ndarray

    def only(self, kept: np.ndarray | slice) -> "Truth":
        """The pairs that a mask, a list of indices or a slice keeps."""
        return Truth(self.w, self.pairs.only(kept), self.scattered_xyz[kept], self.zero_order_xyz)


def measure(
    truth: list[Truth],
    candidate: Candidate,
    illuminant: str = "D65",
    *,
    ratio_ior: float = NO_RATIO,
    worst_by: str = "p99",
) -> Errors:
    """Measure a candidate against the truth. Both are of a dielectric, or hold the reflectance of their matter, whose
    ratio form has the index `ratio_ior`. `worst_by` names the figure by which an exposure is the worst.

    A candidate that returns NaN or infinity has infinite errors of colour."""
    references, answers, zero = [], [], []
    for t in truth:
        factor = t.pairs.radiance_factor(ratio_ior=ratio_ior)[:, None]
        scattered, zero_order = candidate(t.pairs.u, t.pairs.v, t.w)
        references.append(factor * t.scattered_xyz / t.w**2)
        answers.append(factor * scattered)
        zero.append(abs(zero_order[1] - t.zero_order_xyz[1]))
    reference, answer = np.concatenate(references), np.concatenate(answers)
    drawn = np.concatenate([t.pairs.drawn for t in truth])
    if np.isfinite(answer).all():
        group = np.repeat(np.arange(len(truth)), [len(t.pairs.wi) for t in truth])
        colour = worst_exposure(reference, answer, drawn, white=white_xyz(illuminant), group=group, by=worst_by)
    else:
        colour = {**dict.fromkeys(_COLOUR, float("inf")), "share_deviation": 0.0}
    # Relative errors are meaningless if the truth is dark up to rounding; then the errors are absolute.
    total = reference[:, 1].sum() if reference[:, 1].max(initial=0) > _DARK_Y else 0.0
    dy = answer[:, 1] - reference[:, 1]
    rms = np.sqrt(np.mean(reference[:, 1] ** 2)) if total > 0 else 0.0
    return Errors(
        **colour,
        relative_dy=float(np.abs(dy).sum() / total) if total > 0 else float(np.abs(dy).sum()),
        relative_rms=float(np.sqrt(np.mean(dy**2)) / rms) if rms > 0 else float(np.sqrt(np.mean(dy**2))),
        zero_order_dy=float(max(zero)),
        pairs=len(reference),
    )


def worst_exposure(
    reference: np.ndarray,
    answer: np.ndarray,
    drawn: np.ndarray,
    *,
    white: np.ndarray,
    group: np.ndarray | None = None,
    by: str = "p99",
) -> dict[str, float]:
    """Mean, p95, p99, max, p95_of_w, p99_of_w and share_deviation (see Errors) of the CIEDE2000 between two radiances
    (n, 3) in XYZ, at the exposure with the largest figure `by`; p95_of_w and p99_of_w where each is largest.

    Each exposure puts one of EXPOSURE_PERCENTILES of the reference's Y at 1. The percentiles use the pairs in the mask
    `drawn` (n,), which were drawn from the reference's spectrum. white (3,) is the XYZ of white. Pairs of one w
    have the same number in `group` (n,), ascending; their errors may be similar."""
    worst = dict.fromkeys((*_COLOUR, "share_deviation"), 0.0)
    levels = np.percentile(reference[drawn, 1], EXPOSURE_PERCENTILES) if drawn.any() else np.zeros(1)
    # A surface that scatters only rounding is measured at the exposure of its illumination.
    for level in levels[levels > _DARK_Y] if levels.max() > _DARK_Y else [1.0]:
        ref, ans = reference / level, answer / level
        low, high = COUNTED_Y
        counted = np.zeros(len(ref), bool)
        for y in (ref[:, 1], ans[:, 1]):
            counted |= (y >= low) & (y <= high)
        if not counted.any():
            continue
        de = delta_e_2000(lab(ref[counted], white), lab(ans[counted], white))
        p95, p99 = np.percentile(de, [95, 99])
        of_w = np.zeros(2) if group is None else _largest_of_w(de, group[counted])
        found = dict(zip(_COLOUR, map(float, (de.mean(), p95, p99, de.max(), *of_w)), strict=True))
        found["share_deviation"] = _share_deviation(de > p99, None if group is None else group[counted])
        largest = {name: max(worst[name], found[name]) for name in ("p95_of_w", "p99_of_w")}
        worst = max(worst, found, key=lambda each: each[by]) | largest
    return worst


def _largest_of_w(de: np.ndarray, group: np.ndarray) -> np.ndarray:
    """The largest 95th and the largest 99th percentile (2,) of dE00 (n,) in a group (n,) of one w, among groups of at
    least _OF_W pairs."""
    groups = np.split(de, np.flatnonzero(np.diff(group)) + 1)
    found = [np.percentile(each, [95, 99]) for each in groups if len(each) >= _OF_W]
    return np.max([np.zeros(2), *found], axis=0)


def _share_deviation(above: np.ndarray, group: np.ndarray | None) -> float:
    """The standard deviation, by sampling, of the share of pairs above the 99th percentile.

    above (n,) marks these pairs. For independent pairs it is sqrt(0.01 0.99 / n). Errors of pairs in one group are
    similar, so that the groups vary more. The groups have one w from each of as many quantiles, in ascending order, so
    the deviation follows from the steps from group to group (Cochran, Sampling Techniques, 8.11). The larger of the two
    counts. Few steps tell nothing of their own spread, so fewer than _GROUPS_MIN groups count as independent pairs."""
    independent = math.sqrt(_ABOVE * (1 - _ABOVE) / len(above))
    if group is None or group[-1] + 1 < _GROUPS_MIN:
        return independent
    excess = np.bincount(group, above - _ABOVE)
    variance = len(excess) * np.mean(np.diff(excess) ** 2) / 2
    return max(independent, math.sqrt(variance) / len(above))


def stated_errors(delta_e: Mapping[str, Any]) -> list[str]:
    """The lines on the CIEDE2000 that a bake keeps in 99 % of the directions: under lamps as small as the sun, which
    the request limits, and under large ones. An error that the bake did not measure has no line."""
    errors = {"small": delta_e.get("p99_most"), "large": delta_e.get("wide_p99_most")}
    return [
        f"colour error up to {math.ceil(100 * error) / 100:.2f} under {size} lamps"
        for size, error in errors.items()
        if isinstance(error, (int, float)) and math.isfinite(error)
    ]
