# SPDX-License-Identifier: GPL-3.0-or-later
"""What the Lobes material draws from (DESIGN 3): frequencies q in proportion to the spectrum, and what each weighs.

    integral PSD_scattered(q; s) F(q) d^2q  =  mean over texels of s^2 W(texel; s) F(q(texel)),   W = PSD / (s^2 pdf)

so that a shading sample that picks one texel at random and one wavelength, s = w / lambda, needs one glossy closure of
colour rgb(lambda) / pdf(lambda) * R * O * s^2 W. The s^2 cancels against the 1/w^2 of the obliquity O, as in the table.

**pdf** is the mean over s of the scattered spectrum per bin, the spectrum at each s divided by its total. The values of
s are the bake's own Chebyshev nodes: what it holds there are powers, so no bin can come out negative, and at a node a
weight is at most so many times the mean as there are nodes. A spectrum of one s leaves bins nearly out that another s
lights: weights up to 250 x the mean on the Elaphe scan, against 4 x. Without the division by the total, bright large s
crowd out small ones (21 x).

**q** is a bin's own. Bins lie close enough together for the bake's kernel (spectrum.py, series.py), and a lobe is that
kernel, so nothing is gained by a jitter, and an order stays where it is. But bins may have been blurred by part of the
kernel to thin them out: a lobe at lambda has what is left, sqrt(sigma_b^2 - (lambda blur_q)^2). Where scans differ in
that, the less blurred are jittered by the difference, a Gaussian too.

**Texels** are the points of Sobol's (0, 2)-sequence along a Z curve: its first coordinate chooses the row of bins, its
second the bin in the row. So each aligned block of 2^a x 2^a texels is stratified by itself, and next to it lie others:
a material may pick a random texel, or a random block for several lobes at once.

**The file**, NAME.lobes.exr beside the table NAME.exr, has the table's header with a layout of its own. Half floats,
RGBA, Non-Color; to be read with interpolation Closest, since nothing lies between two texels and Blender has one
interpolation for both axes, and alpha mode Channel Packed, since alpha is a number like the others. Rows counted upward
from the bottom; tile k of `size` x `size` texels stands at column k % columns, row k // columns; a draw is the same
texel of two tiles:

    tile 0              (R + B, G + A) = wavelength * q, that is (u, v) at `wavelength` (550 nm): rounded, and the rest
    tile 1 + piece      (R, G, B, A) = c0 .. c3;  W / wavelength^2 = scale (c0 + c1 t + c2 t^2 + c3 t^3)
                        x = pieces * (w wavelength / lambda) / s_last,  piece = min(floor(x), pieces - 1),
                        t = 2 (x - piece) - 1

A half float alone would move an order by up to 1e-3 in u, an eighth of a kernel of 32 um; with its rest, by 1e-6.
Cubics on equal pieces of s take one look-up whatever the relief's depth; a deeper one has more pieces. W may be off by
`INTERPOLATION` of the light. A surface that scatters nothing has one texel that weighs nothing.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import atlas, chebyshev
from .coherence import REFERENCE_WAVELENGTH_M
from .colour import WAVELENGTH_MIN_M
from .series import ROUNDING, SpectrumSeries

SIZE = 256
# Share of the light that the pieces may misplace at any s.
INTERPOLATION = 0.01
# No real pair of directions reaches further, at any visible wavelength.
Q_MAX = 2 / WAVELENGTH_MIN_M
_COEFFICIENTS = 4
# Texels on which the pieces are chosen: a block of the set is a smaller set.
_PROBED = 1024
_PROBES_PER_PIECE = 8
# The rows of a picture that any graphics card takes.
_ROWS_MAX = 8192
# As in atlas.py.
_LARGEST_STORED = 8192.0


@dataclass(frozen=True)
class Lobes:
    """A sample set of N x N texels. `q` (N, N, 2) is (q_x, q_y) in cycles per metre; `pieces` (pieces, N, N, 4) float32
    the coefficients of W in square metres, powers of t ascending, on equal pieces of s from 0 to `s_max`; `blur_q` the
    part of the kernel, in cycles per metre, that is in q already."""

    q: np.ndarray
    pieces: np.ndarray
    s_max: float
    sigma_b: float
    blur_q: float

    def weights(self, s: float) -> np.ndarray:
        """W = PSD_scattered(q; s) / (s^2 pdf(q)), (N, N) in square metres, at s in cycles per metre."""
        piece, powers = _piece_and_powers(np.array([s]), len(self.pieces), self.s_max)
        return self.pieces[piece[0]] @ powers[0]


@dataclass(frozen=True)
class Layout:
    """How a reader finds q and W in the image; what a material's nodes need, and nothing else. `blur` is blur_q and
    `s_last` is s_max, both times `wavelength`."""

    size: int
    pieces: int
    columns: int
    rows: int
    wavelength: float
    s_last: float
    scale: float
    sigma_b: float
    blur: float

    @property
    def width(self) -> int:
        return self.columns * self.size

    @property
    def height(self) -> int:
        return self.rows * self.size

    @property
    def sound(self) -> bool:
        """Whether the numbers can be those of an image: what a header says is believed only then."""
        return (
            all(isinstance(n, int) and n > 0 for n in (self.size, self.pieces, self.columns, self.rows))
            and all(math.isfinite(x) and x > 0 for x in (self.wavelength, self.s_last, self.scale, self.sigma_b))
            and math.isfinite(self.blur)
            and self.blur >= 0
            and 1 + self.pieces <= self.columns * self.rows
        )

    def tile(self, index: int) -> tuple[slice, slice]:
        """Rows, upward, and columns of a tile."""
        row, column = divmod(index, self.columns)
        return slice(row * self.size, (row + 1) * self.size), slice(column * self.size, (column + 1) * self.size)


@dataclass(frozen=True)
class _Drawn:
    """What was drawn from one scan: `numbers` (m,) of the draws, ascending; `over_pdf` (count, m) is W at the nodes."""

    series: SpectrumSeries
    numbers: np.ndarray
    q: np.ndarray
    over_pdf: np.ndarray


def path_beside(table: Path) -> Path:
    """Where the sample set of a table's file lies."""
    return table.with_name(f"{table.stem}.lobes{table.suffix}")


def make_lobes(
    ensemble: Sequence[SpectrumSeries], sigma_b: float, size: int = SIZE, tolerance: float = INTERPOLATION
) -> Lobes:
    """The sample set, `size` (a power of two) texels a side, of the mean of the scans' spectra under a kernel sigma_b;
    its pieces misplace at most `tolerance` of the light at any s."""
    s_max = ensemble[0].s_max
    pdfs = densities(ensemble)
    if pdfs is None:
        return Lobes(np.zeros((1, 1, 2)), np.zeros((1, 1, 1, _COEFFICIENTS), np.float32), s_max, sigma_b, 0.0)
    order = z_curve(size)
    parts = _draw(ensemble, pdfs, sobol_points(size * size))
    blur_q = max(part.series.blur_q for part in parts)
    rng = np.random.default_rng(0)
    q = np.empty((size * size, 2))
    for part in parts:
        lacking = math.sqrt(blur_q**2 - part.series.blur_q**2)
        q[part.numbers] = part.q + lacking * rng.standard_normal(part.q.shape)
    count = _pieces_needed(parts, min(size * size, _PROBED), s_max, tolerance)
    pieces = _fitted(parts, size * size, count, s_max).astype(np.float32)
    return Lobes(q[order], np.moveaxis(pieces[:, :, order], 1, -1), s_max, sigma_b, blur_q)


def densities(ensemble: Sequence[SpectrumSeries]) -> list[np.ndarray] | None:
    """Probability (ny, nx) of each scan's bins, together 1; None if nothing scatters."""
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
    """The first `count` (a power of two) points (count, 2) of Sobol's (0, 2)-sequence, in the middles of their cells.

    Every 2^k points from a multiple of 2^k on have one in each of the 2^k cells of equal size of any grid of 2^i x
    2^(k - i) cells of the unit square (T. Kollig and A. Keller, Efficient multidimensional sampling, 2002)."""
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
    """Number (size, size) of each texel along a Z curve; size is a power of two."""
    spread = sum(((np.arange(size) >> bit) & 1) << (2 * bit) for bit in range(size.bit_length()))
    return spread[:, None] * 2 + spread


def _draw(ensemble: Sequence[SpectrumSeries], pdfs: Sequence[np.ndarray], points: np.ndarray) -> list[_Drawn]:
    """One bin for each point (n, 2): its first coordinate is the share of the rows below, of all scans one after the
    other, its second that of the bins before in the row."""
    cumulative = np.cumsum(np.concatenate([pdf.ravel() for pdf in pdfs]), dtype=float)
    lengths = np.concatenate([np.full(pdf.shape[0], pdf.shape[1]) for pdf in pdfs])
    ends = cumulative[np.cumsum(lengths) - 1]
    # To the right of equals: a bin or row without light is never met.
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
    """W (len(s), count) of the first draws."""
    out = np.empty((len(s), count))
    for part in parts:
        mine = np.searchsorted(part.numbers, count)
        out[:, part.numbers[:mine]] = part.series.weights(s).astype(np.float32) @ part.over_pdf[:, :mine]
    return out


def _fitted(parts: Sequence[_Drawn], count: int, pieces: int, s_max: float) -> np.ndarray:
    """Coefficients (pieces, 4, count) of the cubics through W at each piece's Chebyshev nodes."""
    t = chebyshev.nodes(_COEFFICIENTS, -1, 1)
    to_powers = np.linalg.inv(t[:, None] ** np.arange(_COEFFICIENTS))
    s = (np.arange(pieces)[:, None] + (1 + t) / 2) * s_max / pieces
    return np.stack([to_powers @ _values(parts, of_piece, count) for of_piece in s])


def _pieces_needed(parts: Sequence[_Drawn], count: int, s_max: float, tolerance: float) -> int:
    """The fewest pieces that misplace at most `tolerance` of the light at any s; the error falls as the fourth power of
    their number. What n nodes hold turns by about 2n radians at most: with two pieces a node there are eight values to
    a node, and more would change nothing."""
    most = 2 * max(len(part.over_pdf) for part in parts)
    for pieces in range(1, most):
        s = np.linspace(0, s_max, _PROBES_PER_PIECE * pieces + 1)
        piece, powers = _piece_and_powers(s, pieces, s_max)
        fitted = np.einsum("skn,sk->sn", _fitted(parts, count, pieces, s_max)[piece], powers)
        exact = _values(parts, s, count)
        if (np.abs(fitted - exact).sum(axis=1) <= tolerance * np.abs(exact).sum(axis=1)).all():
            return pieces
    return most


def _piece_and_powers(s: np.ndarray, pieces: int, s_max: float) -> tuple[np.ndarray, np.ndarray]:
    """Piece (n,) in which s (n,) lies, and the powers (n, 4) of t there."""
    x = pieces * s / s_max
    piece = np.minimum(x.astype(int), pieces - 1)
    return piece, (2 * (x - piece) - 1)[:, None] ** np.arange(_COEFFICIENTS)


def layout_of(lobes: Lobes) -> Layout:
    """The layout of a sample set's picture: tiles one above the other, side by side only where they get too high."""
    pieces, size = lobes.pieces.shape[:2]
    columns = math.ceil((1 + pieces) * size / _ROWS_MAX)
    peak = float(np.abs(lobes.pieces).max()) / REFERENCE_WAVELENGTH_M**2 or 1.0
    return Layout(
        size=size,
        pieces=pieces,
        columns=columns,
        rows=math.ceil((1 + pieces) / columns),
        wavelength=REFERENCE_WAVELENGTH_M,
        s_last=lobes.s_max * REFERENCE_WAVELENGTH_M,
        scale=2.0 ** math.ceil(math.log2(peak / _LARGEST_STORED)),
        sigma_b=lobes.sigma_b,
        blur=lobes.blur_q * REFERENCE_WAVELENGTH_M,
    )


def pack(lobes: Lobes) -> tuple[np.ndarray, Layout]:
    """Image (height, width, 4) float16, row 0 at the bottom, and its layout, for atlas.write."""
    layout = layout_of(lobes)
    image = np.zeros((layout.height, layout.width, _COEFFICIENTS), np.float16)
    u = lobes.q * layout.wavelength
    rounded = u.astype(np.float16)
    image[layout.tile(0)] = np.concatenate([rounded, u - rounded], axis=-1)
    for k, piece in enumerate(lobes.pieces):
        image[layout.tile(1 + k)] = piece.astype(float) / (layout.scale * layout.wavelength**2)
    return image, layout


def unpack(image: np.ndarray, layout: Layout) -> Lobes:
    """The sample set that an image (height, width, 4), row 0 at the bottom, holds."""
    u = image[layout.tile(0)].astype(float)
    tiles = np.stack([image[layout.tile(1 + k)] for k in range(layout.pieces)]).astype(float)
    return Lobes(
        (u[..., :2] + u[..., 2:]) / layout.wavelength,
        (tiles * (layout.scale * layout.wavelength**2)).astype(np.float32),
        layout.s_last / layout.wavelength,
        layout.sigma_b,
        layout.blur / layout.wavelength,
    )


def read_header(path: Path) -> tuple[Layout, dict]:
    """Layout and the whole header record of a sample set. Raises GratingError if it is not one."""
    return _parse(path, atlas.open_file(path, header_only=True)[0])


def read(path: Path) -> tuple[Lobes, dict]:
    """The sample set in a file and its header record. Raises GratingError if it is not one."""
    header, channels = atlas.open_file(path, header_only=False)
    layout, record = _parse(path, header)
    return unpack(atlas.image_of(path, channels, (layout.height, layout.width, _COEFFICIENTS)), layout), record


def _parse(path: Path, header: dict) -> tuple[Layout, dict]:
    return atlas.parse(path, header, Layout, "sample set; give the .lobes.exr that `bake` wrote")
