# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of error (DESIGN 6), whatever made the truth and whatever is judged: metric.py measures by them against
the reference, check.py against a truth of its own.

Radiance under unit irradiance, Fresnel and obliquity included; CIEDE2000 at four exposures; the worst exposure is the
figure. The zero order is measured apart.

The form is Stam's: the energy-conserving one divides reference and candidate by the same number, which leaves every
relative error as it is and needs an albedo that most methods do not have.
"""

from dataclasses import asdict, dataclass, replace

import numpy as np

from .brdf import fresnel_reflectance, half_angle_cosine, obliquity_times_cosine_and_w2
from .colour import delta_e_2000, lab, white_xyz

EXPOSURE_PERCENTILES = (50, 90, 99, 99.9)
COUNTED_Y = (0.002, 1.0)
# Radiance under unit irradiance that is rounding alone: phasors are exact to 1e-16, and power is their square.
_DARK_Y = 1e-15


@dataclass(frozen=True)
class Pairs:
    """Direction pairs of equal w: wi, wr (n, 3); `drawn` (n,) marks those drawn from the reference's spectrum."""

    wi: np.ndarray
    wr: np.ndarray
    drawn: np.ndarray

    @property
    def u(self) -> np.ndarray:
        return self.wi[:, 0] + self.wr[:, 0]

    @property
    def v(self) -> np.ndarray:
        return self.wi[:, 1] + self.wr[:, 1]

    def within(self, u_range, v_range) -> "Pairs":
        """Those of u and v inside the ranges (low, high)."""
        u, v = self.u, self.v
        return self.only((u >= u_range[0]) & (u <= u_range[1]) & (v >= v_range[0]) & (v <= v_range[1]))

    def only(self, kept: np.ndarray) -> "Pairs":
        """Those that a mask (n,) keeps."""
        return Pairs(self.wi[kept], self.wr[kept], self.drawn[kept])

    def radiance_factor(self) -> np.ndarray:
        """R * O * cos(ti) * w^2 (n,): what turns scattered XYZ over w^2 into radiance under unit irradiance."""
        reflectance = fresnel_reflectance(half_angle_cosine(self.wi, self.wr))
        return reflectance * obliquity_times_cosine_and_w2(self.wi, self.wr)


@dataclass(frozen=True)
class Errors:
    """Colour errors of one candidate: CIEDE2000 at the worst exposure, |dY| relative to Y, zero order's |dY|."""

    mean: float
    p95: float
    p99: float
    max: float
    relative_dy: float
    relative_rms: float
    zero_order_dy: float
    pairs: int

    def as_dict(self) -> dict[str, float]:
        return asdict(self)

    def worse_by(self, delta_e: float, relative: float) -> "Errors":
        """With an error that was measured apart: of colour, and relative in luminance."""
        colour = {name: getattr(self, name) + delta_e for name in ("mean", "p95", "p99", "max")}
        light = {name: getattr(self, name) + relative for name in ("relative_dy", "relative_rms")}
        return replace(self, **colour, **light)


@dataclass(frozen=True)
class Truth:
    """The reference's answer for one w: pairs, scattered XYZ (n, 3) and the zero order's XYZ (3,)."""

    w: float
    pairs: Pairs
    scattered_xyz: np.ndarray
    zero_order_xyz: np.ndarray


def draw_w(count: int, rng: np.random.Generator) -> np.ndarray:
    """w (count,) as two cosine-weighted directions have it, one from each quantile so that few cover the range."""
    sums = np.sort(np.sqrt(rng.random((4096, 2))).sum(axis=1))
    return sums[((np.arange(count) + rng.random(count)) / count * len(sums)).astype(int)]


def cosine_weighted(w: float, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """wi, wr (count, 3) of cos(ti) + cos(tr) = w, each cosine weighted, of any azimuth."""
    low, high = max(0.0, w - 1), min(1.0, w)
    candidates = rng.uniform(low, high, 64 * count)
    # Density of a cosine-weighted cosine c is 2 c, and its partner is w - c; their product peaks at w / 2.
    kept = candidates[rng.random(len(candidates)) * (w / 2) ** 2 < candidates * (w - candidates)]
    ci = kept[:count]
    azimuth = rng.uniform(0, 2 * np.pi, (2, len(ci)))
    return _direction(ci, azimuth[0]), _direction(w - ci, azimuth[1])


def _direction(cosine: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    sine = np.sqrt(np.maximum(1 - cosine**2, 0))
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=-1)


def pair_about(half: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Unit pairs (n, 3) whose sums are the half vectors (n, 3), both above the surface, otherwise at random."""
    length = np.linalg.norm(half, axis=1, keepdims=True)
    axis = half / length
    side = np.cross(axis, np.where(np.abs(axis[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]]))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    reach = np.sqrt(np.maximum(1 - length**2 / 4, 0))
    offset = np.zeros_like(half)
    pending = np.arange(len(half))
    for _ in range(200):
        turn = rng.uniform(0, 2 * np.pi, (len(pending), 1))
        a, s = axis[pending], side[pending]
        trial = reach[pending] * (np.cos(turn) * s + np.sin(turn) * np.cross(a, s))
        above = np.abs(trial[:, 2]) < half[pending, 2] / 2
        offset[pending[above]] = trial[above]
        pending = pending[~above]
        if len(pending) == 0:
            break
    kept = np.setdiff1d(np.arange(len(half)), pending)
    return (half / 2 + offset)[kept], (half / 2 - offset)[kept]


def measure(truth: list[Truth], candidate, illuminant: str = "D65") -> Errors:
    """Errors of candidate(u, v, w) -> (scattered XYZ / w^2 (n, 3), zero order's XYZ (3,))."""
    reference, answer, drawn, zero = [], [], [], []
    for t in truth:
        factor = t.pairs.radiance_factor()[:, None]
        scattered, zero_order = candidate(t.pairs.u, t.pairs.v, t.w)
        reference.append(factor * t.scattered_xyz / t.w**2)
        answer.append(factor * scattered)
        drawn.append(t.pairs.drawn)
        zero.append(abs(zero_order[1] - t.zero_order_xyz[1]))
    reference, answer, drawn = (np.concatenate(parts) for parts in (reference, answer, drawn))
    if np.isfinite(answer).all():
        figures = worst_exposure(reference, answer, drawn, white_xyz(illuminant))
    else:
        figures = dict.fromkeys(("mean", "p95", "p99", "max"), float("inf"))
    # Relative to nothing, or to a rounding, no error is small: then it is told as it is.
    total = reference[:, 1].sum() if reference[:, 1].max(initial=0) > _DARK_Y else 0.0
    dy = answer[:, 1] - reference[:, 1]
    rms = np.sqrt(np.mean(reference[:, 1] ** 2)) if total > 0 else 0.0
    return Errors(
        **figures,
        relative_dy=float(np.abs(dy).sum() / total) if total > 0 else float(np.abs(dy).sum()),
        relative_rms=float(np.sqrt(np.mean(dy**2)) / rms) if rms > 0 else float(np.sqrt(np.mean(dy**2))),
        zero_order_dy=float(max(zero)),
        pairs=len(reference),
    )


def worst_exposure(reference, answer, drawn, white) -> dict[str, float]:
    """CIEDE2000's mean, p95, p99 and max of radiance (n, 3) in XYZ against a reference, at the worst of the exposures
    that put a percentile of the reference's Y, over the pairs drawn (n,) from its spectrum, at 1."""
    worst = {"mean": 0.0, "p95": 0.0, "p99": 0.0, "max": 0.0}
    levels = np.percentile(reference[drawn, 1], EXPOSURE_PERCENTILES) if drawn.any() else np.zeros(1)
    # A surface that scatters nothing, but for the square of a rounding, is judged as it is lit.
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
        figures = {"mean": float(de.mean()), "p95": float(p95), "p99": float(p99), "max": float(de.max())}
        worst = max(worst, figures, key=lambda f: f["p99"])
    return worst
