# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes a bake's needs from the directions at the places that a scene's cameras see.

Each place reads the table in a box of (u, v, w). Under a lamp the box is as large as the blur by the lamp's disc and by
the skin's roughness. Under light from everywhere it is the whole hemisphere that the view allows. The needs are the
least ranges that hold nearly all of the light in the boxes, plus a margin.

The grating's colours are unknown before its bake, so its spectrum is taken as even.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..optics.brdf import dot, fresnel_reflectance, half_angle_cosine
from ..optics.region import FARTHEST, Region
from ..table.radiance import AS_BAKED, Skin
from .needs import WIDTH_MIN, Needs

# The share of the light whose boxes the ranges hold, and the width by which each range is then extended at both ends.
SHARE, MARGIN = 0.999, 0.02
# The share of the light that may come from pixels across which (u, v) changes by less than the footprint.
_SLOWER = 0.01
# The least and the greatest possible u, v, w.
_LOWEST, _HIGHEST = np.array((-FARTHEST, -FARTHEST, 0.0)), np.array((FARTHEST, FARTHEST, 2.0))
_AXES = ("u", "v", "w")


@dataclass(frozen=True)
class Shown:
    """Boxes of a table's (u, v, w) in which light is read.

    low, high  (n, 3), the ends of each box
    light      (n,), in any unit
    radius     (n,), twice the standard deviation in (u, v) of the blur by the lamp's disc: the angular radius in
               radians of a lamp above the surface; 0 for light without a size
    footprint  (n,), the least change of (u, v) from one side of a pixel to the other; NaN if unknown"""

    low: np.ndarray
    high: np.ndarray
    light: np.ndarray
    radius: np.ndarray
    footprint: np.ndarray

    @property
    def is_dark(self) -> bool:
        """Whether no light is shown."""
        return not self.light.sum() > 0


def under_lamp(
    wr: np.ndarray, wi: np.ndarray, *, irradiance: np.ndarray, variance: np.ndarray, skin: Skin = AS_BAKED,
    footprint: np.ndarray | None = None,
) -> Shown:  # fmt: skip
    """The boxes of places under one lamp. wr and wi (n, 3) are unit vectors to the viewer and to the lamp along each
    place's (T, B, N); `irradiance` (n,) is that of a surface that faces the lamp; `variance` (n,) in rad2 that of the
    lamp's disc along one axis. `footprint` (n,) is the least change of (u, v) across a pixel, before the period scale.

    Places are left out if the viewer or the lamp is below them. The box extends two standard deviations of the blur
    around (u, v), which for a disc is its rim (table/radiance.py has the blur)."""
    lit = (wr[:, 2] > 0) & (wi[:, 2] > 0) & (irradiance > 0)
    wr, wi, irradiance = wr[lit], wi[lit], irradiance[lit]
    uvw = (wi + wr) * _scales(skin)
    disc = variance[lit] * (1 + wi[:, 2] ** 2) / 2
    slopes = ((wi + wr)[:, 2] * skin.roughness**2) ** 2 / 2
    reach = 2 * skin.period_scale * np.sqrt(disc + slopes)[:, None] * (1.0, 1.0, 0.0)
    # Stam's form without 1 / cos(tr). The materials' factors fade faster towards grazing, so their ranges hold more
    # than their share.
    light = irradiance * (1 + dot(wi, wr)) ** 2 * fresnel_reflectance(half_angle_cosine(wi, wr), skin.ior)
    changes = np.full(len(wr), np.nan) if footprint is None else footprint[lit] * skin.period_scale
    return _within_limits(uvw - reach, uvw + reach, light, 2 * skin.period_scale * np.sqrt(disc), changes)


def under_everything(wr: np.ndarray, *, skin: Skin = AS_BAKED) -> Shown:
    """The boxes of places under light from everywhere, for unit vectors wr (n, 3) to the viewer. Places that face the
    viewer have equal weights."""
    wr = wr[wr[:, 2] > 0]
    low = wr - np.array((1.0, 1.0, 0.0))
    zero = np.zeros(len(wr))
    return _within_limits(low * _scales(skin), (wr + 1.0) * _scales(skin), zero + 1, zero, zero)


def joined(parts: Sequence[Shown]) -> Shown:
    """Join boxes; without parts, the result is dark."""
    empty = Shown(np.zeros((0, 3)), np.zeros((0, 3)), *(np.zeros(0) for _ in range(3)))
    fields = zip(*(vars(part).values() for part in (empty, *parts)), strict=True)
    return Shown(*(np.concatenate(field) for field in fields))


def least_change(uv: np.ndarray, beside: np.ndarray, above: np.ndarray) -> np.ndarray:
    """The least change of (u, v) across a pixel, (n,), from (u, v) at its centre (n, 2) and at the centres of the
    pixels beside and above it (n, 2): the smaller singular value of the two steps."""
    a, b = beside - uv, above - uv
    squares = (a**2).sum(axis=1) + (b**2).sum(axis=1)
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    larger = (squares + np.sqrt(np.maximum(squares**2 - 4 * area**2, 0))) / 2
    return np.abs(area) / np.sqrt(np.maximum(larger, 1e-30))


def needs_of(shown: Shown, share: float = SHARE) -> Needs:
    """The needs of light that is not dark: ranges that hold `share` of it, each widened by MARGIN; the radius of its
    smallest lamp; and a footprint that exceeds the true one at no more than 1 % of the light.

    Each end of the three ranges may cut off a sixth of the rest, so that together they hold the share."""
    tail = (1 - share) / 6
    low = [lowest_of(shown.low[:, k], shown.light, share=tail) - MARGIN for k in range(3)]
    high = [-lowest_of(-shown.high[:, k], shown.light, share=tail) + MARGIN for k in range(3)]
    # Four digits, outwards.
    low = np.maximum(np.floor(np.array(low) * 1e4 + 1e-9) / 1e4, _LOWEST)
    high = np.minimum(np.ceil(np.array(high) * 1e4 - 1e-9) / 1e4, _HIGHEST)
    # A range can only be too narrow for a needs file if the hemisphere's rim cuts off the margin.
    low = np.minimum(low, _HIGHEST - WIDTH_MIN)
    high = np.maximum(high, _LOWEST + WIDTH_MIN)
    u, v, w = ((float(a), float(b)) for a, b in zip(low, high, strict=True))
    known = shown.light * ~np.isnan(shown.footprint)
    footprint = lowest_of(np.nan_to_num(shown.footprint), known, share=_SLOWER) if known.any() else 0.0
    radius = min(shown.radius[shown.light > 0].min(), np.pi / 2)
    return Needs(Region(u, v), w, _rounded_down(radius), _rounded_down(min(footprint, 4.0)))


def lowest_of(values: np.ndarray, weights: np.ndarray, *, share: float) -> float:
    """The greatest of the values (n,) below which at most `share` of the weights (n,) lies."""
    order = np.argsort(values, kind="stable")
    below = np.concatenate([[0.0], np.cumsum(weights[order])[:-1]])
    kept = (below <= share * weights.sum()) & (weights[order] > 0)
    return float(values[order][kept][-1]) if kept.any() else float(values[order][-1])


def held_share(shown: Shown, needs: Needs) -> float:
    """The share of the light whose boxes lie within the needs' ranges; 1 if there is no light."""
    low, high = _ends(needs)
    inside = ((shown.low >= low - 1e-9) & (shown.high <= high + 1e-9)).all(axis=1)
    return 1.0 if shown.is_dark else float(shown.light[inside].sum() / shown.light.sum())


def left_out(shown: Shown, needs: Needs, share: float = 0.0) -> list[str]:
    """Describe for each range how far the light exceeds it, without the farthest `share` of the light."""
    low, high = _ends(needs)
    told = []
    for k, axis in enumerate(_AXES):
        if (reached := lowest_of(shown.low[:, k], shown.light, share=share)) < low[k] - 1e-9:
            told.append(f"{axis} down to {reached:.2f}, baked to {low[k]:.2f}")
        if (reached := -lowest_of(-shown.high[:, k], shown.light, share=share)) > high[k] + 1e-9:
            told.append(f"{axis} up to {reached:.2f}, baked to {high[k]:.2f}")
    return told


def _ends(needs: Needs) -> tuple[np.ndarray, np.ndarray]:
    ranges = np.array((*needs.region, needs.w))
    return ranges[:, 0], ranges[:, 1]


def _scales(skin: Skin) -> tuple[float, float, float]:
    """Factors from the surface's (u, v, w) to the table's."""
    return skin.period_scale, skin.period_scale, skin.height_scale


def _within_limits(
    low: np.ndarray, high: np.ndarray, light: np.ndarray, radius: np.ndarray, footprint: np.ndarray
) -> Shown:
    return Shown(np.clip(low, _LOWEST, _HIGHEST), np.clip(high, _LOWEST, _HIGHEST), light, radius, footprint)


def _rounded_down(value: float) -> float:
    """Round a number down to three digits; 0 for what is negligible in (u, v)."""
    if value < 1e-9:
        return 0.0
    step = 10.0 ** (np.floor(np.log10(value)) - 2)
    return float(f"{np.floor(value / step + 1e-9) * step:.3g}")
