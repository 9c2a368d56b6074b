# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a height map's power spectrum: which fineness of lines the surface has, and in which directions.

A wave of a lines per millimetre appears as two points at the distance a from the middle, along its grating vector. Two
rings bound the waves whose first order shows colours (surface/first_order.py)."""

from dataclasses import replace

import numpy as np

from ..surface.first_order import COARSEST_PERIOD_M, FINEST_PERIOD_M
from ..surface.height_map import HeightMap
from ..surface.height_spectrum import Spectrum, spectrum_of
from ..surface.periods import Wave, middle_of, waves_of
from .canvas import SIDE, Canvas, round_below

# The side of the plot and its upper left corner, in pixels.
_PLOT, _LEFT, _TOP = 424, 70, 26
# Black is this share of the brightest visible wave's power. A wave of it is a hundredth as high.
_DARKEST = 1e-4
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
    canvas.paste(_greys(spectrum_of(middle), reach), _LEFT, _TOP)
    _draw_axes(canvas, reach)
    _draw_rings(canvas, reach)
    if gratings:
        _draw_wave(canvas, gratings[0], reach)
    return canvas.pixels()


def _reach(wave: Wave | None) -> float:
    """The lines per millimetre at the plot's edge."""
    most = 1.08 * _RINGS[1]
    return most if wave is None else float(np.clip(_ORDERS * 1e-3 / wave.period_m, 4 * _RINGS[0], most))


def _greys(spectrum: Spectrum, reach: float) -> np.ndarray:
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
    share = np.clip(1 - np.log(np.maximum(power / peak, _DARKEST)) / np.log(_DARKEST), 0, 1)
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
