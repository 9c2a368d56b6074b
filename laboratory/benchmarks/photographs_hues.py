# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures where the hues of a spectrum lie in a picture of a screen, a photograph or a computed one."""

from dataclasses import dataclass

import numpy as np

from precompute.colour.spaces import rgb_from_xyz, srgb_encode

# Angles on the colour circle, in degrees. At 60, 120 and 180 two channels are equal, so a tone curve that is common to
# the channels moves none of them. At 30 and 210 it does.
HUES = {"orange": 30.0, "yellow": 60.0, "green": 120.0, "cyan": 180.0, "azure": 210.0}
# From this encoded value on a channel counts as burnt, as the highest values of an 8-bit picture are compressed.
BURNT = 0.97
REC_709_Y = np.linalg.inv(rgb_from_xyz())[1]
# A place darker than this share of its band's brightest pixel has the hue of noise and stray light.
_DARKEST = 0.05
# Rows that are averaged before a hue is looked for, and pixels beside the place that may not be burnt either.
_SLAB, _MARGIN = 3, 2


@dataclass(frozen=True)
class Band:
    """A part of a picture that holds one order: pixels `near` to `far` from the beam along the order, and `reach` to
    both sides of the beam. `axis` is the way that the order goes in the picture: right, up or down."""

    name: str
    near: int
    far: int
    reach: int
    axis: str = "right"


def linear(encoded: np.ndarray) -> np.ndarray:
    """The light of a picture in sRGB."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def hue_angles(light: np.ndarray) -> np.ndarray:
    """Hue (...) in degrees, from -60 to 300, of linear light (..., 3) as a picture in sRGB shows it."""
    red, green, blue = np.moveaxis(srgb_encode(np.maximum(light, 0)), -1, 0)
    # The hexagon's hue: one channel is the greatest, and the other two tell the place beside it.
    greatest = np.max([red, green, blue], axis=0)
    span = np.maximum(greatest - np.min([red, green, blue], axis=0), 1e-12)
    of_green, of_blue = 2 + (blue - red) / span, 4 + (red - green) / span
    angle = np.where(greatest == red, (green - blue) / span, np.where(greatest == green, of_green, of_blue))
    return (60 * angle + 60) % 360 - 60


def beam_centre(light: np.ndarray, within: slice) -> tuple[float, float]:
    """Row and column of the centroid of the burnt spot in these columns of a picture of linear light."""
    burnt = light.min(axis=-1) >= linear(np.array(BURNT))
    rows, columns = np.nonzero(burnt[:, within])
    return float(rows.mean()), float(columns.mean()) + within.start


def _turned(light: np.ndarray, beam: tuple[float, float], axis: str) -> tuple[np.ndarray, tuple[float, float]]:
    """A picture and its beam, turned so that an axis goes to the right."""
    if axis == "right":
        return light, beam
    row, column = beam
    if axis == "up":
        light, row = light[::-1], len(light) - 1 - row
    return light.swapaxes(0, 1), (column, row)


def distances(light: np.ndarray, beam: tuple[float, float], band: Band) -> dict[str, np.ndarray]:
    """Distances (n,) in pixels from the beam to each hue, in slabs of a few rows from one side of the band to the
    other; NaN where a slab is burnt or dark at this hue, or does not show it."""
    slabs, column = _slabs(light, beam, band)
    start = round(column) + band.near
    slabs = slabs[:, :, start : round(column) + band.far]
    found = {name: np.full(len(slabs), np.nan) for name in HUES}
    for index, slab in enumerate(slabs):
        strip = slab.mean(axis=0)
        brightness = strip.max(axis=-1)
        for name, hue in HUES.items():
            place = parting(strip, hue)
            if np.isnan(place):
                continue
            around = slice(max(int(place) - _MARGIN, 0), int(place) + 2 + _MARGIN)
            burnt = slab[:, around].max() >= linear(np.array(BURNT))
            if not burnt and brightness[int(place)] >= _DARKEST * brightness.max():
                found[name][index] = start + place - column
    return found


def luminances(light: np.ndarray, beam: tuple[float, float], band: Band, where: np.ndarray) -> np.ndarray:
    """Luminance (n,) at the distances (n,) of the band's slabs; NaN where a distance is."""
    slabs, column = _slabs(light, beam, band)
    shown = np.flatnonzero(np.isfinite(where))
    found = np.full(len(where), np.nan)
    found[shown] = slabs[shown, :, np.rint(column + where[shown]).astype(int)].mean(axis=1) @ REC_709_Y
    return found


def parting(strip: np.ndarray, hue: float) -> float:
    """The place along a strip of linear light (n, 3) that best parts higher hues, before it, from lower ones behind it;
    NaN if there is none.

    Each pixel on the wrong side counts by its saturated light, so noise in the dark counts little. The place lies
    between two pixels, and is interpolated. Where the strip stays at the hue, it is the middle of that stretch."""
    above = hue_angles(strip) - hue
    wrong = np.append(0, np.cumsum(-np.sign(above) * np.ptp(strip, axis=-1)))
    best = np.flatnonzero(wrong <= wrong.min() + 1e-12 * np.ptp(wrong))
    if best[0] == 0 or best[-1] == len(strip):
        return np.nan
    if len(best) > 1:
        return (best[0] + best[-1] - 1) / 2
    before, behind = above[best[0] - 1], above[best[0]]
    return float(best[0] - 1 + before / (before - behind))


def _slabs(light: np.ndarray, beam: tuple[float, float], band: Band) -> tuple[np.ndarray, float]:
    """A band's rows (slabs, _SLAB, columns, 3), turned so that the order goes to the right, and the beam's column. The
    picture's edge cuts both sides alike."""
    light, (row, column) = _turned(light, beam, band.axis)
    reach = min(band.reach, round(row), len(light) - 1 - round(row))
    count = (2 * reach + 1) // _SLAB
    first = round(row) - reach
    return light[first : first + count * _SLAB].reshape(count, _SLAB, *light.shape[1:]), column
