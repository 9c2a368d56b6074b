# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a levelled height map: high is bright, with a bar for widths and one for heights."""

import numpy as np

from ..base.packages import bundled
from ..surface.height_map import HeightMap
from ..surface.holes import fill_missing
from .canvas import SIDE, Canvas, round_below

# The height of the legend in pixels.
_LEGEND = 56
# The percentiles of black and white. Without them dust would leave the relief few greys.
_DARKEST, _BRIGHTEST = 1.0, 99.0
_MISSING = (230, 26, 26)
_BAR = 130


def height_picture(levelled: HeightMap) -> np.ndarray:
    """The picture (SIDE, SIDE, 3) of 8 bits, row 0 on top. Missing pixels are red."""
    dark, bright = np.nanpercentile(levelled.height_m, (_DARKEST, _BRIGHTEST))
    high_m, wide_m = levelled.size_m
    scale = min(SIDE / wide_m, (SIDE - _LEGEND) / high_m)
    rows, cols = max(1, round(high_m * scale)), max(1, round(wide_m * scale))
    canvas = Canvas()
    canvas.paste(_greys(levelled, dark, bright, shape=(rows, cols)), (SIDE - cols) // 2, (SIDE - _LEGEND - rows) // 2)
    _draw_width(canvas, scale, wide_m)
    _draw_heights(canvas, bright - dark)
    return canvas.pixels()


def _greys(levelled: HeightMap, dark: float, bright: float, *, shape: tuple[int, int]) -> np.ndarray:
    Image = bundled("PIL.Image")
    size = shape[1], shape[0]
    height = Image.fromarray(fill_missing(levelled).height_m.astype(np.float32))
    # BOX averages where pixels are dropped, and repeats them where they are too few.
    share = (np.array(height.resize(size, Image.Resampling.BOX)) - dark) / ((bright - dark) or 1.0)
    grey = np.rint(np.clip(share, 0, 1) * 255).astype(np.uint8)
    missing = np.array(Image.fromarray(np.isnan(levelled.height_m)).resize(size, Image.Resampling.NEAREST))
    return np.where(missing[..., None], np.array(_MISSING, np.uint8), grey[..., None])


def _draw_width(canvas: Canvas, scale: float, wide_m: float) -> None:
    length_um = round_below(min(wide_m, SIDE / scale) * 1e6 / 3)
    y, length = SIDE - 18, length_um * 1e-6 * scale
    canvas.line(12, y, to=(12 + length, y), width=3)
    canvas.text(f"{length_um:g} um", 12 + length / 2, y - 16, anchor="mm")


def _draw_heights(canvas: Canvas, range_m: float) -> None:
    ramp = np.rint(np.linspace(0, 255, _BAR)).astype(np.uint8)
    x, y = SIDE - _BAR - 60, SIDE - 24
    canvas.paste(np.repeat(np.tile(ramp, (12, 1))[..., None], 3, axis=-1), x, y)
    canvas.text("0", x - 6, y + 6, anchor="rm")
    canvas.text(f"{range_m * 1e9:.3g} nm", x + _BAR + 6, y + 6, anchor="lm")
    canvas.text("height", x + _BAR / 2, y - 10, anchor="mm")
