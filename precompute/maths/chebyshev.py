# SPDX-License-Identifier: GPL-3.0-or-later
"""Chebyshev nodes and interpolation, and the number of terms of the phase exp(i z t) (docs/theory.md, Expansions)."""

from collections.abc import Iterator

import numpy as np


def nodes(count: int, lower: float, upper: float) -> np.ndarray:
    """Return the Chebyshev nodes of the first kind (count,) on [lower, upper], ascending."""
    t = -np.cos(np.pi * (np.arange(count) + 0.5) / count)
    return 0.5 * (lower + upper) + 0.5 * (upper - lower) * t


def polynomials(t: np.ndarray, count: int) -> np.ndarray:
    """Evaluate the Chebyshev polynomials T_0 to T_{count-1} at t (...,) in [-1, 1]; returns (..., count)."""
    return np.cos(np.arange(count) * np.arccos(np.clip(t, -1, 1))[..., None])


def recurrence(t: np.ndarray) -> Iterator[np.ndarray]:
    """Yield T_0, T_1, ... at t (...,) endlessly, in the precision of t, by T_{n+1} = 2 t T_n - T_{n-1}."""
    before, now = t, np.ones_like(t)
    while True:
        yield now
        before, now = now, 2 * t * now - before


def coefficients_from_nodes(count: int) -> np.ndarray:
    """Return the matrix (count, count) from values at `nodes(count, ...)` to Chebyshev coefficients."""
    t = nodes(count, -1, 1)
    matrix = (2 / count) * polynomials(t, count).T
    matrix[0] *= 0.5
    return matrix


def interpolation_matrix(x: np.ndarray, count: int, *, lower: float, upper: float) -> np.ndarray:
    """Return the matrix (..., count) from values at `nodes(count, lower, upper)` to their interpolant at x (...,)."""
    t = (2 * np.asarray(x, float) - lower - upper) / (upper - lower)
    return polynomials(t, count) @ coefficients_from_nodes(count)


def bessel_j(z: float, count: int) -> np.ndarray:
    """Compute the Bessel functions J_0(z) to J_{count-1}(z) (count,), z >= 0.

    Uses Miller's downward recurrence (Abramowitz and Stegun 9.12, example 1)."""
    if z == 0:
        return np.eye(1, count)[0]
    start = int(max(count, z) + 30 + 6 * max(count, z) ** (1 / 3))
    values = np.zeros(start + 2)
    values[start] = 1e-300
    for n in range(start, 0, -1):
        values[n - 1] = 2 * n / z * values[n] - values[n + 1]
        if abs(values[n - 1]) > 1e200:
            values *= 1e-200
    return values[:count] / (values[0] + 2 * values[2::2].sum())


def jacobi_anger_terms(z: float, tolerance: float) -> int:
    """Return the number N of Chebyshev nodes that interpolate exp(i z t) on [-1, 1] to within `tolerance`.

    exp(i z t) = J_0(z) + 2 sum i^n J_n(z) T_n(t) (Abramowitz and Stegun 9.1.44-45). At N nodes, each term n >= N
    aliases to a lower term, and counts twice in the error: at most 4 sum_{n >= N} |J_n(z)|."""
    size = int(2 * z + 60)
    tail = 4 * np.cumsum(np.abs(bessel_j(z, size))[::-1])[::-1]
    return int(np.argmax(tail <= tolerance))
