# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample set of a surface: frequencies q drawn in proportion to its spectrum, and their weights.

A material for lights of every kind draws random samples from it (addon/materials/lobes/). Here q is spatial frequency
in cycles per metre, s = w / lambda, and PSD the scattered power spectrum (docs/theory.md). For every function F,

    integral PSD(q; s) F(q) d^2q  =  mean over texels of s^2 W(texel; s) F(q(texel)),   W = PSD / (s^2 pdf)

where pdf is the density from which the texels' q were drawn. A shading sample picks one random texel and one random
wavelength. It then needs one glossy closure of colour rgb(lambda) / pdf(lambda) * G / w^2 * s^2 W, with
G = 4 cos(ti) cos(tr) Q (optics/brdf.py). As in the table, the s^2 cancels the 1 / w^2.

**pdf** is the mean over s of the scattered spectrum per bin, where the spectrum at each s is first divided by its
total. The values of s are the bake's own Chebyshev nodes. There the series' values are powers, so no bin gets a
negative probability; and at a node no weight exceeds the mean weight times the number of nodes. With a single s, bins
that are dark at this s and bright at another would be drawn too rarely: on the Elaphe scan, weights would reach 250
times the mean, instead of 4 times. Without the division by the total, the bright spectra of large s would crowd out
small s, and weights would reach 21 times the mean.

**q** is the frequency of a bin of the spectrum (spectra/series.py). The bins are close enough for the bake's kernel,
which is the lobe that a closure draws. So q needs no jitter within its bin, and a grating's orders keep their place.
One exception: bins may already be blurred by a part of the kernel, a Gaussian of standard deviation blur_q. It is the
width of a scan's apodisation window, and of a blur that lets fewer bins suffice. A lobe at lambda then has the rest of
the kernel, sqrt(sigma_b^2 - (lambda blur_q)^2). If scans or their axes differ in blur_q, the less blurred frequencies
are jittered by a Gaussian that makes up the difference.

**Texels** are the points of Sobol's (0, 2)-sequence along a Z curve. A point's first coordinate chooses the row of
bins, the second the bin in that row. So every aligned block of 2^a x 2^a texels is a stratified set: a material may
pick a random texel, or a random block for several lobes at once.

**The file**, NAME.lobes.exr beside the table NAME.exr, has the table's header with another layout. It holds half
floats, RGBA, and is read as Non-Color. Its interpolation must be Closest, since a mean of two texels is meaningless
(and Blender has one interpolation for both axes). Its alpha mode must be Channel Packed, since alpha is a number like
the others. Rows are counted upward from the bottom. Tile k, of `size` x `size` texels, is at column k % columns and row
k // columns. A draw reads the same texel of two tiles:

    tile 0              (R + B, G + A) = wavelength * q, that is (u, v) at `wavelength` (550 nm): R and G are rounded to
                        half floats, B and A hold the rounding errors
    tile 1 + piece      (R, G, B, A) = c0 .. c3;  W / wavelength^2 = scale (c0 + c1 t + c2 t^2 + c3 t^3)
                        x = pieces * (w wavelength / lambda) / s_last,  piece = min(floor(x), pieces - 1),
                        t = 2 (x - piece) - 1

A single half float would move an order by up to 1e-3 in u, an eighth of the kernel of a coherence of 32 um; two move it
by 1e-6. W is a cubic in s on each of several equal pieces of the range of s, so that one look-up suffices for every
relief; a deeper relief has more pieces. W may be off by the share INTERPOLATION (bake/sample_draws.py) of the light. A
surface that scatters nothing has one texel of weight 0.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..base.exr_reader import Picture, open_picture
from ..colour.observer import S_MAX
from ..optics.coherence import REFERENCE_WAVELENGTH_M
from . import atlas

# Texels a side. On Elaphe at w = 1.6 this misplaces 2.4 % of the light, and 512 misplace 0.9 % (docs/data_flow.md).
SIZE = 256
# Coefficients of a cubic; also the number of channels of a picture.
COEFFICIENTS = 4
# Rows of a picture that any graphics card accepts.
_ROWS_MAX = 8192
# The scale puts the largest value under this number, for the reason given at LARGEST_STORED of atlas.py.
_LARGEST_STORED = 8192.0
# The largest scale. Every half float times this scale is finite in single precision.
_SCALE_MAX = 1e30


@dataclass(frozen=True)
class SampleSet:
    """A sample set of N x N texels.

    q        (N, N, 2), the frequencies (q_x, q_y) in cycles per metre
    pieces   (pieces, N, N, 4) float32, the coefficients of W in square metres, in ascending powers of t, on equal
             pieces of s from 0 to `s_max`, in cycles per metre
    sigma_b  the standard deviation of the coherence kernel in (u, v)
    blur_q   the part of the kernel, in cycles per metre, that q already contains"""

    q: np.ndarray
    pieces: np.ndarray
    s_max: float
    sigma_b: float
    blur_q: float

    def weights(self, s: float) -> np.ndarray:
        """W = PSD(q; s) / (s^2 pdf(q)) of every texel, (N, N) in square metres, at s in cycles per metre."""
        piece, powers = piece_and_powers(np.array([s]), len(self.pieces), self.s_max)
        return self.pieces[piece[0]] @ powers[0]


@dataclass(frozen=True)
class SampleSetLayout:
    """How a reader finds q and W in the image. A material's nodes need nothing else.

    `blur` and `s_last` are the sample set's blur_q and s_max times `wavelength`, in metres. The picture has `rows` x
    `columns` tiles of `size` x `size` texels."""

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
        """Columns of the picture."""
        return self.columns * self.size

    @property
    def height(self) -> int:
        """Rows of the picture."""
        return self.rows * self.size

    @property
    def is_valid(self) -> bool:
        """Whether a sample set can have this layout. Headers with other layouts are rejected."""
        return (
            min(self.size, self.pieces, self.columns, self.rows) >= 1
            and 0 < self.s_last <= REFERENCE_WAVELENGTH_M * S_MAX
            and 0 < self.scale <= _SCALE_MAX
            and 0 < self.sigma_b <= 1
            and self.wavelength == REFERENCE_WAVELENGTH_M
            and 0 <= self.blur <= self.sigma_b
            and 1 + self.pieces <= self.columns * self.rows
        )

    def tile(self, index: int) -> tuple[slice, slice]:
        """Rows, counted upward, and columns of a tile."""
        row, column = divmod(index, self.columns)
        return slice(row * self.size, (row + 1) * self.size), slice(column * self.size, (column + 1) * self.size)


def path_beside(table: Path) -> Path:
    """The path of the sample set of a table's file: NAME.lobes.exr beside NAME.exr."""
    return table.with_name(f"{table.stem}.lobes{table.suffix}")


def piece_and_powers(s: np.ndarray, pieces: int, s_max: float) -> tuple[np.ndarray, np.ndarray]:
    """The piece (n,) that contains each s (n,), and the powers (n, 4) of t there."""
    x = pieces * s / s_max
    piece = np.minimum(x.astype(int), pieces - 1)
    return piece, (2 * (x - piece) - 1)[:, None] ** np.arange(COEFFICIENTS)


def layout_of(lobes: SampleSet) -> SampleSetLayout:
    """The layout of a sample set's picture.

    Tiles are stacked in one column, or in more columns if one would be higher than _ROWS_MAX."""
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


def pack(lobes: SampleSet, layout: SampleSetLayout | None = None) -> tuple[np.ndarray, SampleSetLayout]:
    """Image (height, width, 4) float16, row 0 at the bottom, and its layout, for atlas.write_together: its own, or a
    given one with more tiles and another scale."""
    layout = layout or layout_of(lobes)
    image = np.zeros((layout.height, layout.width, COEFFICIENTS), np.float16)
    u = lobes.q * layout.wavelength
    rounded = u.astype(np.float16)
    image[layout.tile(0)] = np.concatenate([rounded, u - rounded], axis=-1)
    for k, piece in enumerate(lobes.pieces):
        image[layout.tile(1 + k)] = piece.astype(float) / (layout.scale * layout.wavelength**2)
    return image, layout


def pack_layers(sets: Sequence[SampleSet]) -> tuple[np.ndarray, tuple[SampleSetLayout, ...]]:
    """The images of sample sets of one size, side by side, and the layout of each."""
    own = [layout_of(each) for each in sets]
    columns, scale = max(each.columns for each in own), max(each.scale for each in own)
    rows = max(math.ceil((1 + each.pieces) / columns) for each in own)
    layouts = tuple(replace(each, columns=columns, rows=rows, scale=scale) for each in own)
    images = [pack(*pair)[0] for pair in zip(sets, layouts, strict=True)]
    return np.concatenate(images, axis=1), layouts


def unpack(image: np.ndarray, layout: SampleSetLayout) -> SampleSet:
    """The sample set in an image (height, width, 4), row 0 at the bottom."""
    u = image[layout.tile(0)].astype(float)
    tiles = np.stack([image[layout.tile(1 + k)] for k in range(layout.pieces)]).astype(float)
    return SampleSet(
        (u[..., :2] + u[..., 2:]) / layout.wavelength,
        (tiles * (layout.scale * layout.wavelength**2)).astype(np.float32),
        layout.s_last / layout.wavelength,
        layout.sigma_b,
        layout.blur / layout.wavelength,
    )


def read_header(path: Path) -> tuple[SampleSetLayout, dict[str, Any]]:
    """Layout and header record of a sample set. Raises GratingError if the file is not a sample set."""
    return _parse(open_picture(path))


def read(path: Path) -> tuple[SampleSet, dict[str, Any]]:
    """Read the sample set in a file, and its header record. Raises GratingError if the file is not a sample set."""
    picture = open_picture(path)
    layout, record = _parse(picture)
    return unpack(picture.pixels(), layout), record


def read_sound_header(path: Path) -> tuple[SampleSetLayout, dict[str, Any]]:
    """read_header for a file that Blender is going to read: checks every pixel too.

    Raises GratingError if the file is not a sample set, its picture is damaged or a pixel is not a number."""
    picture = open_picture(path)
    found = _parse(picture)
    picture.check_pixels()
    return found


def _parse(picture: Picture) -> tuple[SampleSetLayout, dict[str, Any]]:
    expected = "sample set", "give the .lobes.exr that `bake` wrote"
    return atlas.parse(picture, SampleSetLayout, channels="RGBA", expected=expected)
