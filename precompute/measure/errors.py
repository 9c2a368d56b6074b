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

from ..colour.difference import delta_e_2000, lab
from ..colour.observer import white_xyz
from .pairs import Pairs

EXPOSURE_PERCENTILES = (50, 90, 99, 99.9)


COUNTED_Y = (0.002, 1.0)


# Radiance under unit irradiance that is rounding alone: phasors are exact to 1e-16, and power is their square.
_DARK_Y = 1e-15


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
