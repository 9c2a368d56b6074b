# SPDX-License-Identifier: GPL-3.0-or-later
"""How strongly lamps light objects, to choose the lamps that light diffraction (find.py).

Shadows and the direction of spots and area lamps are ignored: lamps may turn, but a render chooses them only once."""

import math
from collections.abc import Sequence

import bpy
import numpy as np

# The luminance of linear Rec.709. Accurate enough to choose lamps in other working spaces.
LUMINANCE = (0.2126, 0.7152, 0.0722)
# The distance in metres at which lamps are compared if no object shows diffraction yet. It matters only between suns
# and other lamps: at 3 m, typical of a studio, a point lamp of 113 W is as bright as a sun of 1 W/m2.
_AFAR = 3.0
# The least distance of a lamp, as a share of the box's half diagonal. A lamp inside a box is not on the surface.
_NEAREST = 0.1
# The least distance in metres, for boxes of zero size.
_LEAST = 1e-6
# Lamps times boxes compared at once, so that arrays stay below 2 MB each.
_AT_ONCE = 2**16


def irradiances(lamps: Sequence[bpy.types.Object], boxes: np.ndarray | tuple[()]) -> np.ndarray:
    """For each lamp, the largest irradiance (luminance, W/m2) at one of the boxes (n, 2, 3), which are minimum and
    maximum corners in world space. Without boxes, all lamps are compared at the same distance.

    The nearest point of a box counts: a lamp beside one end of a long object lights that end."""
    matrices = np.array([lamp.matrix_world for lamp in lamps], float).reshape(-1, 4, 4)
    scales = np.linalg.norm(matrices[:, :3, :2], axis=1).tolist()
    power = np.array([_power(lamp.data, *scale) for lamp, scale in zip(lamps, scales, strict=True)])
    is_sun = np.array([lamp.data.type == "SUN" for lamp in lamps], bool)
    squared = np.full(len(lamps), _AFAR**2 if len(boxes) == 0 else np.inf)
    parts = max(1, -(-len(boxes) * len(lamps) // _AT_ONCE))
    for part in np.array_split(boxes, parts) if len(boxes) else ():
        # Boxes with NaN corners, from damaged meshes, are ignored.
        squared = np.fmin(squared, np.fmin.reduce(_squared_distances(matrices[:, :3, 3], part), axis=1))
    return np.nan_to_num(power / np.where(is_sun, 1.0, squared))


def _squared_distances(places: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """Squared distances (lamps, boxes) from points (n, 3) to the nearest points of boxes (m, 2, 3)."""
    low, high = boxes[:, 0], boxes[:, 1]
    outside = np.maximum(np.maximum(low - places[:, None], places[:, None] - high), 0.0)
    half_diagonal = np.linalg.norm(high - low, axis=1) / 2
    return np.maximum((outside**2).sum(axis=2), np.maximum(_NEAREST * half_diagonal, _LEAST) ** 2)


def _power(light: bpy.types.Light, x_scale: float, y_scale: float) -> float:
    """The luminance of `power` (lamp_properties.py): a sun's irradiance, W/m2, or another lamp's radiant intensity,
    W/sr; its absolute value for lamps of negative strength."""
    red, green, blue = light.color
    if light.use_temperature:
        heat = light.temperature_color
        red, green, blue = red * heat[0], green * heat[1], blue * heat[2]
    luminance = LUMINANCE[0] * red + LUMINANCE[1] * green + LUMINANCE[2] * blue
    return abs(light.energy * 2.0**light.exposure * luminance * _per_watt(light, x_scale, y_scale))


def _per_watt(light: bpy.types.Light, x_scale: float, y_scale: float) -> float:
    """The factor from a lamp's strength to `power`, as a number; lamp_properties.py has the same formula as an
    expression."""
    if light.type == "SUN":
        return 1.0 if light.normalize else math.pi * math.sin(min(light.angle, math.pi) / 2) ** 2
    if light.type in {"POINT", "SPOT"}:
        return 1 / (4 * math.pi) if light.normalize else light.shadow_soft_size**2
    if light.normalize:
        return 1 / math.pi
    height = light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else light.size
    share = 1.0 if light.shape in {"SQUARE", "RECTANGLE"} else math.pi / 4
    return share * light.size * x_scale * height * y_scale / math.pi
