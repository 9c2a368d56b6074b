# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures for artists, of a height map and of its power spectrum.

In a levelled height map's picture high is bright, with a bar for widths and one for heights. A power spectrum shows
which fineness of lines the surface has, and in which directions. A wave of a lines per millimetre appears as two points
at the distance a from the middle, along its grating vector. Two rings bound the waves whose first order shows colours
(surface/periods.py)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..base.machine import bundled
from ..surface.height_map import HeightMap, fill_missing
from ..surface.periods import COARSEST_PERIOD_M, FINEST_PERIOD_M, Spectrum, Wave, middle_of, spectrum_of, waves_of

if TYPE_CHECKING:
    from PIL import Image


# The side of a picture in pixels. A .blend that holds it grows by less than 1 MiB.
SIDE = 512
GROUND, INK, FAINT = (28, 28, 28), (225, 225, 225), (130, 130, 130)
_LETTERS = 13

Colour = tuple[int, int, int]


class Canvas:
    """A picture of SIDE x SIDE pixels; x to the right and y downward, in pixels."""

    def __init__(self) -> None:
        self._image: Image.Image = bundled("PIL.Image").new("RGB", (SIDE, SIDE), GROUND)
        self._draw = bundled("PIL.ImageDraw").Draw(self._image)
        self._font = bundled("PIL.ImageFont").load_default(_LETTERS)

    def paste(self, pixels: np.ndarray, x: int, y: int) -> None:
        """Put pixels (rows, cols, 3) of 8 bits, row 0 on top, with their upper left corner at (x, y)."""
        self._image.paste(bundled("PIL.Image").fromarray(pixels), (x, y))

    def text(self, words: str, x: float, y: float, *, anchor: str = "la", colour: Colour = INK) -> None:
        """Write words on a dark ground. `anchor` is Pillow's: "la" puts (x, y) at their upper left, "mm" in the
        middle."""
        self._draw.text((x, y), words, fill=colour, font=self._font, anchor=anchor, stroke_width=2, stroke_fill=GROUND)

    def line(self, x0: float, y0: float, *, to: tuple[float, float], colour: Colour = INK, width: int = 1) -> None:
        """Draw a line."""
        self._draw.line((x0, y0, *to), fill=colour, width=width)

    def circle(self, x: float, y: float, radius: float, *, colour: Colour, filled: bool = False) -> None:
        """Draw a circle, or a disc."""
        box = (x - radius, y - radius, x + radius, y + radius)
        self._draw.ellipse(box, outline=colour, fill=colour if filled else None)

    def pixels(self) -> np.ndarray:
        """The picture (SIDE, SIDE, 3) of 8 bits, row 0 on top."""
        return np.array(self._image)


def round_below(value: float) -> float:
    """The largest 1, 2 or 5 times a power of ten up to a positive value."""
    power = 10.0 ** math.floor(math.log10(value) + 1e-9)
    return max(step * power for step in (1, 2, 5) if step * power <= value * (1 + 1e-9))


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


# The side of the plot and its upper left corner, in pixels.
_PLOT, _LEFT, _TOP = 424, 70, 26
# Black is this share of the brightest visible wave's power. A wave of it is a hundredth as high.
_FAINTEST = 1e-4
# How bright waves are that show no colours.
_DIMMED = 0.4
_RINGS = (1e-3 / COARSEST_PERIOD_M, 1e-3 / FINEST_PERIOD_M)
# The plot reaches this multiple of the main wave's fineness, to show its second and third orders.
_ORDERS = 3.5
_MARK = (90, 200, 255)
_RING = (255, 190, 60)


def spectrum_picture(levelled: HeightMap) -> np.ndarray:
    """The picture (SIDE, SIDE, 3) of 8 bits, row 0 on top, in the directions of the height map's picture."""
    gratings = waves_of(levelled).gratings
    reach = _reach(gratings[0] if gratings else None)
    canvas = Canvas()
    middle = replace(levelled, height_m=levelled.height_m[middle_of(levelled)], periodic=False)
    canvas.paste(_spectrum_greys(spectrum_of(middle), reach), _LEFT, _TOP)
    _draw_axes(canvas, reach)
    _draw_rings(canvas, reach)
    if gratings:
        _draw_wave(canvas, gratings[0], reach)
    return canvas.pixels()


def _reach(wave: Wave | None) -> float:
    """The lines per millimetre at the plot's edge."""
    most = 1.08 * _RINGS[1]
    return most if wave is None else float(np.clip(_ORDERS * 1e-3 / wave.period_m, 4 * _RINGS[0], most))


def _spectrum_greys(spectrum: Spectrum, reach: float) -> np.ndarray:
    """The plot (_PLOT, _PLOT, 3): the logarithm of the greatest power in each pixel."""
    lines = (np.arange(_PLOT) + 0.5) * 2 * reach / _PLOT - reach
    ny, nx = len(spectrum.power), spectrum.cols
    high_m, wide_m = spectrum.size_m
    power = np.zeros((_PLOT, _PLOT))
    for row in _bins(lines, high_m, reach):
        for col in _bins(lines, wide_m, reach):
            ky, kx = np.broadcast_arrays(row[:, None], col)
            inside = (np.abs(ky) <= (ny - 1) // 2) & (np.abs(kx) <= (nx - 1) // 2)
            ky, kx = np.where(kx < 0, -ky, ky)[inside], np.abs(kx)[inside]
            power[inside] = np.maximum(power[inside], spectrum.power[ky % ny, kx])
    fineness = np.hypot(lines[:, None], lines)
    visible = (fineness >= _RINGS[0]) & (fineness <= _RINGS[1])
    peak = power[visible].max() or 1.0
    share = np.clip(1 - np.log(np.maximum(power / peak, _FAINTEST)) / np.log(_FAINTEST), 0, 1)
    grey = np.rint(share * np.where(visible, 255, 255 * _DIMMED)).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=-1)


def _bins(lines: np.ndarray, length_m: float, reach: float) -> list[np.ndarray]:
    """Whole cycles per scan at the plot's pixels: one array for each bin that a pixel covers."""
    cycles = lines * 1e3 * length_m
    per_pixel = 2e3 * reach * length_m / _PLOT
    count = max(1, int(np.ceil(per_pixel)))
    offsets = (np.arange(count) + 0.5) / count - 0.5
    return [np.rint(cycles + offset * per_pixel).astype(int) for offset in offsets]


def _middle() -> tuple[float, float]:
    return _LEFT + _PLOT / 2, _TOP + _PLOT / 2


def _draw_axes(canvas: Canvas, reach: float) -> None:
    step = round_below(reach / 2)
    x, y = _middle()
    for number in range(-int(reach / step), int(reach / step) + 1):
        at = number * step / reach * _PLOT / 2
        canvas.line(x + at, _TOP + _PLOT, to=(x + at, _TOP + _PLOT + 5))
        canvas.text(f"{abs(number) * step:g}", x + at, _TOP + _PLOT + 14, anchor="mm")
        canvas.line(_LEFT - 5, y + at, to=(_LEFT, y + at))
        canvas.text(f"{abs(number) * step:g}", _LEFT - 9, y + at, anchor="rm")
    canvas.text("lines per mm", x, SIDE - 24, anchor="mm")


def _draw_rings(canvas: Canvas, reach: float) -> None:
    """Draw the limits of colours. A ring beyond the plot is told in words."""
    for lines in _RINGS:
        if lines <= reach:
            canvas.circle(*_middle(), lines / reach * _PLOT / 2, colour=_RING)
    canvas.text(
        f"First orders show colours from {_RINGS[0]:.0f} to {_RINGS[1]:.0f} lines/mm", SIDE / 2, SIDE - 8,
        anchor="mm", colour=_RING,
    )  # fmt: skip


def _draw_wave(canvas: Canvas, wave: Wave, reach: float) -> None:
    """Draw a ring round both points of the main wave, and write its fineness."""
    lines = 1e-3 / wave.period_m
    x, y = _middle()
    angle = np.radians(wave.angle_deg)
    dx, dy = (lines / reach * _PLOT / 2 * part for part in (np.cos(angle), -np.sin(angle)))
    for sign in (1, -1):
        canvas.circle(x + sign * dx, y + sign * dy, 8, colour=_MARK)
    canvas.text(f"{wave.in_words()}: {lines:.0f} lines/mm", SIDE / 2, 12, anchor="mm", colour=_MARK)
