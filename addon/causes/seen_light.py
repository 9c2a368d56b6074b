# SPDX-License-Identifier: GPL-3.0-or-later
"""The diffraction colours of a grating that a camera or a 3D view sees, by the grating's own table."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from ...precompute.optics.mirror_image import LEAST_VARIANCE
from ...precompute.table.atlas_file import read
from ...precompute.table.radiance import Skin, lamp_radiance
from ...precompute.table.table import Table
from ..cameras.camera_look import in_frames, skin_of, turned
from ..cameras.seen_surfaces import Places
from ..gratings.grating import Grating
from ..gratings.lights_choice import LAMPS_ONLY
from ..lamps.irradiance import Sent, lamps_sent, sources_sent
from ..lamps.strength import LUMINANCE
from ..materials.group_properties import lights_of, variation_of

# The least luminance that shows on a screen beside lit surfaces, where 1 is white: a pixel of 25 of 255.
_VISIBLE = 0.01
# The least saturation, (max - min) / max, of a colour that is not taken for white.
_SATURATED = 0.25
# A smaller share of what is seen may be a few pixels of a rim, which nobody takes for diffraction colours.
SHARE_MIN = 0.005
# The mirror image of a lamp reaches this many standard deviations.
_MIRROR = 3.0
# The irradiance in W/m2, after the exposure, of a well lit surface: that of the sun that the panel adds.
WELL_LIT = 3.0
# A lamp whose disc has a larger standard deviation, in radians, is wide: a radius of 11 degrees.
_WIDE = 0.1
# Directions of a grating that varies over the surface.
_TURNS = 5
# The table that was read last, by its file and the time of the file's last change.
_kept: dict[tuple[Path, int], Table] = {}


@dataclass(frozen=True)
class SeenLight:
    """The light at n places, all of one grating.

    lit       (n,), the largest irradiance by a lamp in W/m2, after the scene's exposure; 0 where every lamp or the
              viewer is below the surface
    radiance  (n, 3), linear Rec.709 by all lamps, after the scene's exposure; without the mirror images of small lamps
    distance  (n,), |(u, v)| of the table under the lamp that lights most places; NaN where it lights none"""

    lit: np.ndarray
    radiance: np.ndarray
    distance: np.ndarray

    @property
    def coloured_share(self) -> float:
        """The share of the places with colours that can be seen."""
        return float((self._bright(_VISIBLE) & self._saturated).mean())

    @property
    def is_too_weak(self) -> bool:
        """Whether there would be colours if the lamps lit the surface well."""
        dimness = float(np.median(self.lit[self.lit > 0])) / WELL_LIT if self.lit.any() else 1.0
        return dimness < 1 and float((self._bright(_VISIBLE * dimness) & self._saturated).mean()) >= SHARE_MIN

    @property
    def white_share(self) -> float:
        """The share of the places whose diffraction can be seen but is nearly white."""
        return float((self._bright(_VISIBLE) & ~self._saturated).mean())

    def _bright(self, least: float) -> np.ndarray:
        return self.radiance @ np.array(LUMINANCE) >= least

    @property
    def _saturated(self) -> np.ndarray:
        most, least = self.radiance.max(axis=1), self.radiance.min(axis=1)
        return most - least > _SATURATED * np.maximum(most, 1e-30)


def table_of(grating: Grating) -> Table | None:
    """The table of a grating's bake, or None if its file is not there or damaged. The last one is kept, as a
    large file takes half a second."""
    try:
        path = grating.baked_file()
        key = path, path.stat().st_mtime_ns
        if key not in _kept:
            _kept.clear()
            _kept[key], _ = read(path)
        return _kept[key]
    except (GratingError, OSError):
        return None


def light_at(scene: bpy.types.Scene, seen: list[Places], table: Table) -> SeenLight:
    """The light at the places that a look found, at least one. Shadows are ignored."""
    exposure = 2.0**scene.view_settings.exposure
    if scene.render.engine == "CYCLES":
        exposure *= scene.cycles.film_exposure
    parts = [_at(scene, places, table) for places in seen]
    lit, radiance, distance = (np.concatenate(part) for part in zip(*parts, strict=True))
    return SeenLight(lit * exposure, radiance * exposure, distance)


def colour_range(table: Table, w: float) -> tuple[float, float]:
    """The range of |(u, v)| that holds 90 % of the light that a table scatters at `w`, outside its mirror image."""
    v, u = table.axes
    distance = np.hypot(*np.meshgrid(u, v)).ravel()
    light = np.maximum(table.at_w(min(max(w, table.w_range[0]), table.w_range[1]))[..., 1].ravel(), 0)
    light[distance < _MIRROR * table.sigma_b] = 0
    order = np.argsort(distance)
    total = np.cumsum(light[order])
    low, high = np.searchsorted(total, (0.05 * total[-1], 0.95 * total[-1]))
    return tuple(float(distance[order][min(k, len(order) - 1)]) * table.plate_ior for k in (low, high))  # type: ignore[return-value]  # a pair


def sent_to(scene: bpy.types.Scene, places: Places) -> list[Sent]:
    """The light of the lamps, and of the world's sources if the grating reads them."""
    sent = lamps_sent(scene, places.thing, places.points)
    if lights_of(places.node.node_tree) != LAMPS_ONLY:
        sent += sources_sent(scene, places.points)
    return sent


def _at(scene: bpy.types.Scene, places: Places, table: Table) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The irradiance at places, their radiance, and |(u, v)| under the lamp that lights most of them."""
    wr, skin = in_frames(places, places.to_view), skin_of(places.node)
    lit, radiance = np.zeros(len(wr)), np.zeros((len(wr), 3))
    distance, most = np.full(len(wr), np.nan), 0
    for sent in sent_to(scene, places):
        wi = in_frames(places, sent.direction)
        at = np.flatnonzero((wi[:, 2] > 0) & (wr[:, 2] > 0) & (sent.irradiance > 0))
        if not len(at):
            continue
        lit[at] = np.maximum(lit[at], sent.irradiance[at])
        u, v, w = (wi + wr)[at].T
        away = np.hypot(u, v)
        if len(at) > most:
            most, distance[:] = len(at), np.nan
            distance[at] = away * skin.period_scale
        shown = np.max([_radiance(table, sent, at, pair=pair, skin=skin) for pair in _pairs(places, wi, wr)], axis=0)
        spread = np.maximum(sent.variance[at], LEAST_VARIANCE) + (w * skin.roughness**2) ** 2 / 2
        mirror = away < _MIRROR * np.sqrt(spread)
        # The mirror image of a wide lamp covers the surface with white; that of a small one is a point.
        grey = (shown @ np.array(LUMINANCE)) * (sent.variance[at] > _WIDE**2)
        radiance[at] += np.where(mirror[:, None], grey[:, None], shown)
    return lit, radiance, distance


def _pairs(places: Places, wi: np.ndarray, wr: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The directions to the lamp and to the viewer along the grating, which a variation may turn."""
    turn = variation_of(places.node.node_tree).turn
    for angle in np.linspace(-turn, turn, _TURNS) if turn else (0.0,):
        yield turned(wi, angle), turned(wr, angle)


def _radiance(
    table: Table, sent: Sent, at: np.ndarray, *, pair: tuple[np.ndarray, np.ndarray], skin: Skin
) -> np.ndarray:
    """The radiance (n, 3) that one lamp causes at some of the places."""
    wi, wr = pair
    return lamp_radiance(
        table, wi[at], wr[at], irradiance=sent.irradiance[at, None], variance=sent.variance[at], skin=skin
    )
