# SPDX-License-Identifier: GPL-3.0-or-later
"""The phasor as a Chebyshev series (Jacobi-Anger): FLSS's images without its cancellation.

    exp(-i z t) = J_0(z) + 2 sum_n (-i)^n J_n(z) T_n(t),   h = c + a t, t in [-1, 1], z = 2 pi s a

(Abramowitz and Stegun 9.1.44-45.) c is the middle height and a is half of the height range. For a relief of any depth
the coefficients are at most 2 and the polynomials at most 1.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Literal

import numpy as np

from ..colour.observer import S_MAX
from ..maths import chebyshev
from ..surface.relief import Relief
from .method import MethodEntry, Settings
from .windowed_images import WindowedImages, windowed


@dataclass(frozen=True)
class Chebyshev:
    """The expansion: terms T_n((h - middle_m) / half_range_m), n = 0 .. terms - 1."""

    terms: int
    middle_m: float
    half_range_m: float
    series: Literal["taylor", "chebyshev"] = "chebyshev"

    @property
    def scale_m(self) -> float:
        """See Expansion."""
        return self.half_range_m

    def fields(self, height_m: np.ndarray) -> Iterator[np.ndarray]:
        """T_n(t) for n = 0 .. terms - 1, by the three-term recurrence."""
        yield from islice(chebyshev.recurrence((height_m - self.middle_m) / self.half_range_m), self.terms)

    def coefficients(self, s: np.ndarray) -> np.ndarray:
        """J_0(z), 2 (-i)^n J_n(z) (m, terms), without the phase of the middle height, which |P|^2 ignores.

        They interpolate exp(-i z t) at enough nodes to keep the aliased terms below the rounding error."""
        z = 2 * np.pi * self.half_range_m * np.asarray(s, float)
        nodes = max(self.terms, _nodes(float(z.max(initial=0))))
        values = np.exp(-1j * z[:, None] * chebyshev.nodes(nodes, -1, 1))
        return values @ chebyshev.coefficients_from_nodes(nodes)[: self.terms].T


def _nodes(z: float) -> int:
    # z is rounded up, so that calls at nearby wavelengths share their nodes. A greater z only needs more nodes.
    return chebyshev.jacobi_anger_terms(math.ceil(z), 1e-15)


def terms_needed(z: float, tolerance: float) -> int:
    """The fewest terms whose tail, 2 sum_{n >= N} |J_n(z)|, is at most `tolerance`."""
    return max(1, chebyshev.jacobi_anger_terms(z, 2 * tolerance))


def expansion_for(relief: Relief, settings: Settings, s_max: float = S_MAX) -> Chebyshev:
    """The Chebyshev expansion of a relief up to s_max."""
    low, high = float(relief.height_m.min()), float(relief.height_m.max())
    half = max((high - low) / 2, 1e-12)
    terms = settings.terms or terms_needed(2 * np.pi * s_max * half, settings.tolerance)
    return Chebyshev(terms, (low + high) / 2, half)


def build(relief: Relief, settings: Settings) -> WindowedImages:
    """Build FLSS over Chebyshev images."""
    return windowed("chebyshev", relief, expansion_for(relief, settings), settings=settings)


ENTRY = MethodEntry("chebyshev", "patch", build, has_shader=True)
