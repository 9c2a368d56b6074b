# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands in the header of a file of DFT images (dft_images.py), and how it is read.

This module loads no method, so that Blender's start-up does not pay for them.
"""

import math
from dataclasses import dataclass
from pathlib import Path

from ..table import atlas_file


@dataclass(frozen=True)
class Layout:
    """What a shader needs beside the image. A quantity that the method has no use for is 0 (sigma_f, period_m) or 1
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
        from .registry import SHADER_METHODS  # only here: the registry loads every method

        counts = self.terms, self.tile_rows, self.tile_columns, self.columns, self.texels, self.copies_v, self.copies_u
        return (
            self.method in SHADER_METHODS
            and self.expansion in ("taylor", "chebyshev")
            and all(isinstance(n, int) and n > 0 for n in counts)
            and all(x > 0 for x in (self.length_v_m, self.length_u_m, self.scale_m, self.power, self.step_m))
        )


def read_layout(path: Path) -> Layout:
    """The layout in a file's header. Raises GratingError if it is not a file of images."""
    header, _ = atlas_file.open_file(path, header_only=True)
    return atlas_file.parse(path, header, Layout, expected="file of DFT images; give the .exr that `dft` wrote")[0]
