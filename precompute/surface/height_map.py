# SPDX-License-Identifier: GPL-3.0-or-later
"""Height maps: measured or synthetic heights over a rectangle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.failure import GratingError
from ..base.files import short_stem

# "sample:NAME" and "grating:KIND?PARAMETERS" name synthetic surfaces wherever a file can be named.
SAMPLE_PREFIX = "sample:"
GRATING_PREFIX = "grating:"


def is_synthetic(source: str) -> bool:
    """Whether a source names a synthetic surface, which needs no file: a sample, or a grating by its parameters."""
    return source.startswith((SAMPLE_PREFIX, GRATING_PREFIX))


@dataclass(frozen=True, eq=False)
class HeightMap:
    """Heights over a rectangle.

    height_m        (rows, cols) float64 in metres, positive outward, NaN where not measured; read-only. The scan's x
                    axis, left to right, runs along the tangent T; row 0 is the top, so the row index runs along -B
    pixel_size_m    (dy, dx) in metres
    source          a path, "sample:NAME" or "grating:KIND?PARAMETERS"
    channel         the channel's label; "" if the format has no channels
    channels        labels of all channels of the source
    periodic        whether the edges wrap exactly, as on synthetic surfaces
    stored_width_m  the width in the file if the user's width replaces it, NaN if the file stores none; else None

    Raises GratingError unless the heights are a two-dimensional array with a finite value and without infinite ones,
    and the pixel sizes are positive and finite."""

    height_m: np.ndarray
    pixel_size_m: tuple[float, float]
    source: str
    channel: str = ""
    channels: tuple[str, ...] = ()
    periodic: bool = False
    stored_width_m: float | None = None

    def __post_init__(self) -> None:
        height = np.asarray(self.height_m, dtype=np.float64).view()
        if height.ndim != 2 or height.size == 0:
            raise GratingError(self.source, f"heights of shape {height.shape} are no map", "give rows by columns")
        pixel = tuple(float(side) for side in self.pixel_size_m)
        if len(pixel) != 2 or not all(math.isfinite(side) and side > 0 for side in pixel):
            raise GratingError(self.source, f"pixel size {pixel} m is not positive", "give the real size of the scan")
        if np.isinf(height).any():
            raise GratingError(self.source, "some heights are infinite", "mark them as missing (NaN)")
        if np.isnan(height).all():
            raise GratingError(self.source, "every height is missing", "choose another channel or scan")
        height.flags.writeable = False
        object.__setattr__(self, "height_m", height)
        object.__setattr__(self, "pixel_size_m", pixel)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return self.height_m.shape[0]

    @property
    def cols(self) -> int:
        """Number of columns."""
        return self.height_m.shape[1]

    @property
    def source_name(self) -> str:
        """The file's name without folders, or a synthetic surface's whole source; a bake records it."""
        return self.source if is_synthetic(self.source) else Path(self.source).name

    @property
    def stem(self) -> str:
        """The file's name without folders and extension, or a synthetic surface's name as a file name, shortened if it
        is very long."""
        if self.source.startswith(GRATING_PREFIX):
            # Windows allows none of these three characters in a file name.
            return short_stem(self.source.translate(str.maketrans(":?&", "___")))
        is_sample = self.source.startswith(SAMPLE_PREFIX)
        return self.source.removeprefix(SAMPLE_PREFIX) if is_sample else short_stem(Path(self.source).stem)

    @property
    def size_m(self) -> tuple[float, float]:
        """(Ly, Lx): the scan's sides in metres, from outer edge to outer edge."""
        return self.rows * self.pixel_size_m[0], self.cols * self.pixel_size_m[1]
