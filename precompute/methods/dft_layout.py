# SPDX-License-Identifier: GPL-3.0-or-later
"""The header of a file of DFT images (dft_images.py), and its reader.

This module loads no method, which keeps Blender's start-up fast.
"""

import math
from dataclasses import dataclass
from pathlib import Path

from ..base.exr_reader import Picture, open_picture
from ..colour.illuminants import ILLUMINANTS
from ..table import atlas

# The most terms of the verb `dft`, and the most texels that a shader reads along an axis.
TERMS_MAX, TEXELS_MAX = 1000, 31
# Ranges of a shader's values, in SI units, as wide as the verb's options and as heights and sides of any scan: a relief
# is between 1 pm and 1 mm deep, a scan at most a metre long, a period 10 nm to 1 mm, a wavelength step 0.1 to 100 nm. A
# window of at least a pixel of 1 pm has a transform narrower than 1e12 cycles per metre. The power is an area, at least
# that of this pixel.
_RANGES = {
    "length_v_m": (1e-12, 1.0),
    "length_u_m": (1e-12, 1.0),
    "scale_m": (1e-12, 1e-3),
    "sigma_f": (0.0, 1e12),
    "power": (1e-24, 1.0),
    "period_m": (0.0, 1e-3),
    "step_m": (1e-10, 1e-7),
}
# So many copies of a cell of 1 nm are as long as the longest allowed coherence length, 10 mm.
_COPIES_MAX = 10**7


@dataclass(frozen=True)
class Layout:
    """What a shader needs beside the image. A quantity that the method does not use is 0 (sigma_f, period_m) or 1
    (copies_v, copies_u).

    length_*_m  sides of the transformed relief in metres, along B (v) and T (u); a bin is 1 / length
    scale_m     metres of height that count as 1 in the expansion
    sigma_f     standard deviation of the Gaussian window's transform, cycles per metre
    power       factor from |sum|^2 / lambda^2 to the density over (u, v), square metres
    copies_*    number of copies of the cell, along B (v) and T (u)
    texels      number of texels read around each frequency along each axis
    """

    method: str
    expansion: str
    terms: int
    tile_rows: int
    tile_columns: int
    columns: int
    length_v_m: float
    length_u_m: float
    scale_m: float
    sigma_f: float
    power: float
    copies_v: int
    copies_u: int
    period_m: float
    texels: int
    step_m: float
    illuminant: str

    @property
    def rows(self) -> int:
        """The number of rows of tiles."""
        return math.ceil(self.terms / self.columns)

    @property
    def width(self) -> int:
        """The width of the image in texels."""
        return self.columns * self.tile_columns

    @property
    def height(self) -> int:
        """The height of the image in texels."""
        return self.rows * self.tile_rows

    @property
    def is_valid(self) -> bool:
        """Whether a shader can evaluate the images."""
        from .method_registry import SHADER_METHODS  # only here: the registry loads every method

        return (
            self.method in SHADER_METHODS
            and self.expansion in ("taylor", "chebyshev")
            and self.illuminant in ILLUMINANTS
            and min(self.tile_rows, self.tile_columns, self.columns) >= 1
            and 1 <= self.terms <= TERMS_MAX
            and 1 <= self.texels <= TEXELS_MAX
            and all(1 <= copies <= _COPIES_MAX for copies in (self.copies_v, self.copies_u))
            and all(low <= getattr(self, name) <= high for name, (low, high) in _RANGES.items())
        )


def read_layout(path: Path) -> Layout:
    """Read the layout in a file's header. Raises GratingError if it is not a file of images."""
    return _layout_of(open_picture(path))


def read_sound_layout(path: Path) -> Layout:
    """read_layout for a file that Blender is going to read: checks every texel too.

    Raises GratingError if it is not a file of images, if it is damaged or if a texel is not a number."""
    picture = open_picture(path)
    layout = _layout_of(picture)
    picture.check_pixels()
    return layout


def _layout_of(picture: Picture) -> Layout:
    expected = "file of DFT images", "give the .exr that `dft` wrote"
    return atlas.parse(picture, Layout, expected=expected)[0]
