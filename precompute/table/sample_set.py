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
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..optics.coherence import REFERENCE_WAVELENGTH_M
from . import atlas_file

SIZE = 256


COEFFICIENTS = 4


# The rows of a picture that any graphics card takes.
_ROWS_MAX = 8192


# As in atlas.py.
_LARGEST_STORED = 8192.0


@dataclass(frozen=True)
class SampleSet:
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
        piece, powers = piece_and_powers(np.array([s]), len(self.pieces), self.s_max)
        return self.pieces[piece[0]] @ powers[0]


@dataclass(frozen=True)
class SampleSetLayout:
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
    def is_valid(self) -> bool:
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


def path_beside(table: Path) -> Path:
    """Where the sample set of a table's file lies."""
    return table.with_name(f"{table.stem}.lobes{table.suffix}")


def piece_and_powers(s: np.ndarray, pieces: int, s_max: float) -> tuple[np.ndarray, np.ndarray]:
    """Piece (n,) in which s (n,) lies, and the powers (n, 4) of t there."""
    x = pieces * s / s_max
    piece = np.minimum(x.astype(int), pieces - 1)
    return piece, (2 * (x - piece) - 1)[:, None] ** np.arange(COEFFICIENTS)


def layout_of(lobes: SampleSet) -> SampleSetLayout:
    """The layout of a sample set's picture: tiles one above the other, side by side only where they get too high."""
    pieces, size = lobes.pieces.shape[:2]
    columns = math.ceil((1 + pieces) * size / _ROWS_MAX)
    peak = float(np.abs(lobes.pieces).max()) / REFERENCE_WAVELENGTH_M**2 or 1.0
    return SampleSetLayout(
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


def pack(lobes: SampleSet) -> tuple[np.ndarray, SampleSetLayout]:
    """Image (height, width, 4) float16, row 0 at the bottom, and its layout, for atlas.write."""
    layout = layout_of(lobes)
    image = np.zeros((layout.height, layout.width, COEFFICIENTS), np.float16)
    u = lobes.q * layout.wavelength
    rounded = u.astype(np.float16)
    image[layout.tile(0)] = np.concatenate([rounded, u - rounded], axis=-1)
    for k, piece in enumerate(lobes.pieces):
        image[layout.tile(1 + k)] = piece.astype(float) / (layout.scale * layout.wavelength**2)
    return image, layout


def unpack(image: np.ndarray, layout: SampleSetLayout) -> SampleSet:
    """The sample set that an image (height, width, 4), row 0 at the bottom, holds."""
    u = image[layout.tile(0)].astype(float)
    tiles = np.stack([image[layout.tile(1 + k)] for k in range(layout.pieces)]).astype(float)
    return SampleSet(
        (u[..., :2] + u[..., 2:]) / layout.wavelength,
        (tiles * (layout.scale * layout.wavelength**2)).astype(np.float32),
        layout.s_last / layout.wavelength,
        layout.sigma_b,
        layout.blur / layout.wavelength,
    )


def read_header(path: Path) -> tuple[SampleSetLayout, dict]:
    """Layout and the whole header record of a sample set. Raises GratingError if it is not one."""
    return _parse(path, atlas_file.open_file(path, header_only=True)[0])


def read(path: Path) -> tuple[SampleSet, dict]:
    """The sample set in a file and its header record. Raises GratingError if it is not one."""
    header, channels = atlas_file.open_file(path, header_only=False)
    layout, record = _parse(path, header)
    return unpack(atlas_file.image_of(path, channels, (layout.height, layout.width, COEFFICIENTS)), layout), record


def _parse(path: Path, header: dict) -> tuple[SampleSetLayout, dict]:
    return atlas_file.parse(path, header, SampleSetLayout, "sample set; give the .lobes.exr that `bake` wrote")
