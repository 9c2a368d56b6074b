# SPDX-License-Identifier: GPL-3.0-or-later
"""FLSS: full lambda space sampling with Taylor images (thesis Algorithms 1 and 3).

    exp(-i 2 pi s h) = sum_n (-2 pi s)^n / n! (i h)^n

Heights are counted from the lowest point, as in the thesis, or from the middle of the relief, which halves z = 2 pi s
max|h|. The terms grow to e^z / sqrt(2 pi z) before they fall, while their sum has modulus 1: the digits above 1 cancel
and are lost. So a sum fails by too few terms, or by too few digits, which more terms cannot fix.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..base.failure import GratingError, Setting
from ..colour.observer import S_MAX
from ..surface.relief import Relief
from .method import MethodEntry, Settings
from .windowed_images import WindowedImages, windowed

# A relief whose phasor would have a larger error is refused.
LOSS_MAX = 1e-2
# The number of terms in the thesis.
THESIS_TERMS = 37


def truncation_error(z: float, terms: int) -> float:
    """Bound of the error of exp(-i z), z >= 0, after N = `terms` terms: z^N / N! (Lagrange; |derivatives| = 1)."""
    return math.exp(terms * math.log(z) - math.lgamma(terms + 1)) if z > 0 else 0.0


def terms_needed(z: float, tolerance: float) -> int:
    """The fewest terms N for which truncation_error is at most `tolerance`. Beyond N = z that bound only falls."""
    terms = max(1, math.ceil(z))
    while truncation_error(z, terms) > tolerance:
        terms += 1
    return terms


def rounding_bound(z: float, dtype: type) -> float:
    """Bound of the error by cancellation for any number of terms: half a last digit of every term, eps / 2 * e^z."""
    return float(np.finfo(dtype).eps) / 2 * math.exp(min(z, 700.0))


def expected_loss(z: float, dtype: type) -> float:
    """Error by cancellation in practice: half a last digit of the largest term, z^n / n! at n = z (Stirling)."""
    return rounding_bound(z, dtype) / math.sqrt(max(2 * math.pi * z, 1.0))


@dataclass(frozen=True)
class Taylor:
    """The expansion: terms (i h / scale_m)^n, with h from origin_m. The scale keeps the powers representable."""

    terms: int
    origin_m: float
    scale_m: float
    series: Literal["taylor", "chebyshev"] = "taylor"

    def fields(self, height_m: np.ndarray) -> Iterator[np.ndarray]:
        """(i h / scale)^n for n = 0 .. terms - 1."""
        x = 1j * (height_m - self.origin_m) / self.scale_m
        power = np.ones_like(x)
        for _ in range(self.terms):
            yield power
            power = power * x

    def coefficients(self, s: np.ndarray) -> np.ndarray:
        """(-2 pi s scale)^n / n! (m, terms)."""
        z = (-2 * np.pi * self.scale_m) * np.asarray(s, float)[:, None]
        factors = z / np.maximum(np.arange(self.terms), 1)
        factors[:, 0] = 1
        return np.cumprod(factors, axis=1)


def expansion_for(relief: Relief, settings: Settings, s_max: float = S_MAX) -> Taylor:
    """The Taylor expansion of a relief up to s_max.

    Raises GratingError if cancellation leaves too few digits, whatever the number of terms."""
    low, high = float(relief.height_m.min()), float(relief.height_m.max())
    origin = (low + high) / 2 if settings.centred else low
    scale = max(high - origin, 1e-12)
    z = 2 * np.pi * s_max * scale
    loss = expected_loss(z, settings.dtype)
    if loss > LOSS_MAX:
        name = np.dtype(settings.dtype).name
        raise GratingError(
            "flss",
            f"the Taylor series of {(high - low) * 1e9:.0f} nm of relief cannot converge in {name}: at s = "
            f"{s_max * 1e-6:.2f} / um its largest term is e^{z:.1f} / sqrt(2 pi {z:.1f}), which leaves an error of "
            f"{loss:.2g} (bound {rounding_bound(z, settings.dtype):.2g})",
            ("take ", Setting.METHOD, " chebyshev"),
        )
    return Taylor(settings.terms or terms_needed(z, settings.tolerance), origin, scale)


def build(relief: Relief, settings: Settings) -> WindowedImages:
    """Build FLSS of a relief. Raises GratingError for a relief that is too deep for the series."""
    return windowed("flss", relief, expansion_for(relief, settings), settings=settings)


ENTRY = MethodEntry("flss", "patch", build, has_shader=True)
