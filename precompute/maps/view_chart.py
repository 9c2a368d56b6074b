# SPDX-License-Identifier: GPL-3.0-or-later
"""The chart of a bake: which colour goes where, for light from one angle.

Its disc is a BRDF map (brdf_map.py): the middle is a view along the normal, the rim one along the surface. The strip
below it shows the views in the plane of the light, from the light's side to the other."""

import numpy as np

from ..colour.gamut import shown_rgb
from ..colour.working_space import rgb_from_xyz, srgb_encode
from ..table.radiance import reflected_xyz
from ..table.table import Table
from .brdf_map import from_bake, light_from
from .canvas import FAINT, GROUND, INK, SIDE, Canvas

# The disc's side and its upper left corner; the strip's upper edge, height and width; all in pixels.
_DISC, _LEFT, _TOP = 408, 52, 8
_STRIP_TOP, _STRIP_HIGH, _STRIP = 448, 24, 448
# Y of this percentile of the disc's views is shown as white. The mirror image clips.
_WHITE = 99.5
_RINGS_DEG = (30, 60)
_LAMP = (255, 210, 60)


def view_chart(table: Table, light_deg: float) -> np.ndarray:
    """The picture (SIDE, SIDE, 3) of 8 bits, row 0 on top, for light at an angle from the normal, from the left."""
    theta_i = np.radians(light_deg)
    wi = light_from(theta_i)
    xyz = from_bake(table, _DISC, wi)
    level = _level(xyz[..., 1])
    canvas = Canvas()
    disc = _coded(xyz / level, table.illuminant)
    disc[~np.isfinite(xyz[..., 1])] = GROUND
    canvas.paste(disc[::-1], _LEFT, _TOP)
    _draw_rings(canvas, theta_i)
    angles = np.radians((np.arange(_STRIP) + 0.5) * 180 / _STRIP - 90)
    views = np.stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)], axis=-1)
    xyz = reflected_xyz(table, wi, views, variance=table.kernel_variance)
    strip = _coded(xyz / level, table.illuminant)
    canvas.paste(np.tile(strip, (_STRIP_HIGH, 1, 1)), (SIDE - _STRIP) // 2, _STRIP_TOP)
    _draw_degrees(canvas)
    canvas.text(f"light {light_deg:g} deg", 8, 14, anchor="lm", colour=_LAMP)
    return canvas.pixels()


def _level(luminance: np.ndarray) -> float:
    """The luminance that is shown as white."""
    known = luminance[np.isfinite(luminance)]
    level = float(np.percentile(known, _WHITE))
    return level if level > 0 else max(float(known.max()), 1e-30)


def _coded(xyz: np.ndarray, illuminant: str) -> np.ndarray:
    rgb = shown_rgb(np.nan_to_num(xyz), rgb_from_xyz("Rec.709", illuminant))
    return np.rint(srgb_encode(rgb) * 255).astype(np.uint8)


def _draw_rings(canvas: Canvas, theta_i: float) -> None:
    radius = _DISC / 2
    x, y = _LEFT + radius, _TOP + radius
    canvas.circle(x, y, radius, colour=FAINT)
    for degrees in _RINGS_DEG:
        ring = radius * np.sin(np.radians(degrees))
        canvas.circle(x, y, ring, colour=FAINT)
        canvas.text(f"{degrees}", x, y - ring, anchor="mm")
    lamp = radius * np.sin(theta_i)
    canvas.circle(x - lamp, y, 4, colour=_LAMP, filled=True)
    canvas.text("mirror", x + lamp, y + 14, anchor="mm")
    canvas.circle(x + lamp, y, 4, colour=INK)


def _draw_degrees(canvas: Canvas) -> None:
    left = (SIDE - _STRIP) / 2
    for degrees in range(-90, 91, 30):
        x, y = left + (degrees + 90) / 180 * _STRIP, _STRIP_TOP + _STRIP_HIGH
        canvas.line(x, y, to=(x, y + 4))
        canvas.text(f"{degrees}", x, y + 12, anchor="mm")
    canvas.text("angle of view in the plane of the light, in degrees", SIDE / 2, SIDE - 8, anchor="mm")
