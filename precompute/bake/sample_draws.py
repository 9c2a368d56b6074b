# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the sample set of a bake: frequencies drawn in proportion to the spectrum, and their weights.

The docstring of table/sample_set.py describes the method and its symbols.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from ..colour.observer import WAVELENGTH_MIN_M
from ..maths import chebyshev
from ..spectra.series import ROUNDING, SpectrumSeries
from ..table.sample_set import COEFFICIENTS, SIZE, SampleSet, piece_and_powers

# Share of the light that the pieces may misplace at any s.
INTERPOLATION = 0.01
# In cycles per metre: |(u, v)| is at most 2, so no pair of directions reaches further at any visible wavelength.
Q_MAX = 2 / WAVELENGTH_MIN_M
# Number of texels on which the number of pieces is chosen. The first texels along the Z curve are a smaller sample set.
_PROBED = 1024
# Values of s at which a piece is compared with the series: twice the number of its cubic's coefficients.
_PROBES_PER_PIECE = 8


@dataclass(frozen=True)
class _Drawn:
    """The draws from one scan.

    `numbers` (m,) are the numbers of the draws, ascending. `q` (m, 2) are their frequencies. `over_pdf` (count, m) is
    the weight W of each draw at the `count` Chebyshev nodes of the scan's series."""

    series: SpectrumSeries
    numbers: np.ndarray
    q: np.ndarray
    over_pdf: np.ndarray


def make_sample_set(
    ensemble: Sequence[SpectrumSeries], sigma_b: float, size: int = SIZE, *, tolerance: float = INTERPOLATION
) -> SampleSet:
    """Make the sample set of the mean of the scans' spectra under a kernel sigma_b.

    It has `size` texels along each side, a power of two. Its pieces misplace at most the share `tolerance` of the light
    at any s."""
    s_max = ensemble[0].s_max
    pdfs = densities(ensemble)
    if pdfs is None:
        return SampleSet(np.zeros((1, 1, 2)), np.zeros((1, 1, 1, COEFFICIENTS), np.float32), s_max, sigma_b, 0.0)
    order = z_curve(size)
    parts = _draw(ensemble, pdfs, sobol_points(size * size))
    held = [np.hypot(part.series.blur_q, part.series.grid.window_q[::-1]) for part in parts]
    blur_q = float(np.max(held))
    rng = np.random.default_rng(0)
    q = np.empty((size * size, 2))
    for part, own in zip(parts, held, strict=True):
        q[part.numbers] = part.q + np.sqrt(blur_q**2 - own**2) * rng.standard_normal(part.q.shape)
    count = _pieces_needed(parts, min(size * size, _PROBED), s_max, tolerance)
    pieces = _fitted(parts, size * size, count, s_max).astype(np.float32)
    return SampleSet(q[order], np.moveaxis(pieces[:, :, order], 1, -1), s_max, sigma_b, blur_q)


def densities(ensemble: Sequence[SpectrumSeries]) -> list[np.ndarray] | None:
    """Probability (ny, nx) of each bin of each scan; all sum to 1. None if the scans scatter only rounding."""
    nodes = [chebyshev.nodes(len(series.amplitude), 0, series.s_max) for series in ensemble]
    inside = [series.grid.q_y[:, None] ** 2 + series.grid.q_x**2 <= Q_MAX**2 for series in ensemble]
    totals = [
        np.array([power[real].sum(dtype=float) for power in series.scattered_over_s2])
        for series, real in zip(ensemble, inside, strict=True)
    ]
    if max((total * s**2).max() for total, s in zip(totals, nodes, strict=True)) <= ROUNDING:
        return None
    found = []
    for series, s, real in zip(ensemble, nodes, inside, strict=True):
        of_all = sum(np.maximum(each.weights(s) @ total, 0) for each, total in zip(ensemble, totals, strict=True))
        mix = (1 / (len(s) * of_all)).astype(series.scattered_over_s2.dtype)
        found.append(np.tensordot(mix, series.scattered_over_s2, axes=1) * real)
    whole = sum(density.sum(dtype=float) for density in found)
    return [density / whole for density in found]


def sobol_points(count: int) -> np.ndarray:
    """The first `count` points (count, 2) of Sobol's (0, 2)-sequence, at the centres of their cells.

    `count` is a power of two. Divide the unit square into 2^k equal cells by any grid of 2^i x 2^(k - i), and take 2^k
    successive points, the first with a number that is a multiple of 2^k. Then each cell contains exactly one of these
    points (T. Kollig and A. Keller, Efficient multidimensional sampling, 2002)."""
    bits = count.bit_length() - 1
    number = np.arange(count)
    first, second = np.zeros(count, int), np.zeros(count, int)
    direction = top = count >> 1
    for bit in range(bits):
        is_set = (number >> bit) & 1
        first ^= is_set * (top >> bit)
        second ^= is_set * direction
        direction ^= direction >> 1
    return (np.column_stack([first, second]) + 0.5) / count


def z_curve(size: int) -> np.ndarray:
    """The number of each texel (size, size) along a Z curve. `size` is a power of two."""
    bits = (((np.arange(size) >> bit) & 1) << (2 * bit) for bit in range(size.bit_length()))
    spread: np.ndarray = reduce(np.add, bits)
    return spread[:, None] * 2 + spread


def _draw(ensemble: Sequence[SpectrumSeries], pdfs: Sequence[np.ndarray], points: np.ndarray) -> list[_Drawn]:
    """Draw one bin for each point (n, 2).

    The rows of bins of all scans form one long list. The point's first coordinate is the share of the light in the rows
    before the drawn row. Its second coordinate is the share of the row's light in the bins before the drawn bin."""
    cumulative = np.cumsum(np.concatenate([pdf.ravel() for pdf in pdfs]), dtype=float)
    lengths = np.concatenate([np.full(pdf.shape[0], pdf.shape[1]) for pdf in pdfs])
    ends = cumulative[np.cumsum(lengths) - 1]
    # The search goes to the right of equal values, so that a bin or row without light is never drawn.
    row = np.searchsorted(ends, points[:, 0] * ends[-1], side="right")
    below = np.where(row > 0, ends[row - 1], 0.0)
    bins = np.searchsorted(cumulative, below + points[:, 1] * (ends[row] - below), side="right")
    found, start = [], 0
    for series, pdf in zip(ensemble, pdfs, strict=True):
        numbers = np.flatnonzero((bins >= start) & (bins < start + pdf.size))
        y, x = np.unravel_index(bins[numbers] - start, pdf.shape)
        q = np.column_stack([series.grid.q_x[x], series.grid.q_y[y]])
        over_pdf = series.scattered_over_s2[:, y, x] / (len(ensemble) * pdf[y, x])
        found.append(_Drawn(series, numbers, q, over_pdf))
        start += pdf.size
    return [part for part in found if len(part.numbers)]


def _values(parts: Sequence[_Drawn], s: np.ndarray, count: int) -> np.ndarray:
    """The weights W (len(s), count) of the first `count` draws, at each s of s (n,)."""
    out = np.empty((len(s), count))
    for part in parts:
        mine = np.searchsorted(part.numbers, count)
        out[:, part.numbers[:mine]] = part.series.weights(s).astype(np.float32) @ part.over_pdf[:, :mine]
    return out


def _fitted(parts: Sequence[_Drawn], count: int, pieces: int, s_max: float) -> np.ndarray:
    """Coefficients (pieces, 4, count) of the cubics through W at each piece's Chebyshev nodes."""
    t = chebyshev.nodes(COEFFICIENTS, -1, 1)
    to_powers = np.linalg.inv(t[:, None] ** np.arange(COEFFICIENTS))
    s = (np.arange(pieces)[:, None] + (1 + t) / 2) * s_max / pieces
    return np.stack([to_powers @ _values(parts, of_piece, count) for of_piece in s])


def _pieces_needed(parts: Sequence[_Drawn], count: int, s_max: float, tolerance: float) -> int:
    """The fewest pieces that misplace at most the share `tolerance` of the light at any s.

    The error falls as the fourth power of the number of pieces. A curve of n Chebyshev nodes oscillates over at most
    about 2n radians. Two pieces per node have eight coefficients per node, so more pieces would change nothing.
    """
    most = 2 * max(len(part.over_pdf) for part in parts)
    for pieces in range(1, most):
        s = np.linspace(0, s_max, _PROBES_PER_PIECE * pieces + 1)
        piece, powers = piece_and_powers(s, pieces, s_max)
        fitted = np.einsum("skn,sk->sn", _fitted(parts, count, pieces, s_max)[piece], powers)
        exact = _values(parts, s, count)
        if (np.abs(fitted - exact).sum(axis=1) <= tolerance * np.abs(exact).sum(axis=1)).all():
            return pieces
    return most
