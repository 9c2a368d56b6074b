# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of what the 3D view, or the camera where the artist looks through it, sees of the grating. They compute its
diffraction colours by its own table."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ...precompute.bake.shown_directions import held_share, joined
from ...precompute.base.failure import GratingError
from ...precompute.optics.mirror_image import LEAST_VARIANCE
from ...precompute.table.atlas import read
from ...precompute.table.radiance import Skin, lamp_radiance
from ...precompute.table.table import Table
from ..blender import compat
from ..cameras.camera_look import Look, camera_pixels, in_frames, look_through, skin_of, turned
from ..cameras.seen_surfaces import Pixels, Places, ViewPixels
from ..gratings.bakes import noted_region
from ..gratings.grating import LAMPS_ONLY, Grating
from ..lamps.brightest_lamps import LUMINANCE, lamps_of
from ..lamps.irradiance import Sent, lamps_sent, sources_sent
from ..materials.group_properties import lights_of, traces_shadows, variation_of
from ..materials.material import listed
from ..materials.response import response_in
from .setting_causes import why_dark
from .subject import Button, Cause, Subject, held_out, light_button, mend

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
    """The light of the lamps, and of the world's sources if the grating reads them. A light rig's cards show what is
    metal, and no colours of diffraction."""
    sent = lamps_sent(scene, places.thing, places.points, cards=False)
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


# Rays of a look, and rays to the lamp that look for shadows.
_RAYS, _SHADOW_RAYS = 2000, 100
# A share of what is seen that is easily overlooked, as a streak on a cube.
_SHARE_FEW = 0.05
# A share of the light outside a bake's region that an artist notices as black.
_OUTSIDE_MIN = 0.1
# |(u, v)| that asks for light and view at 37 degrees and more off the normal, both on the same side.
_GRAZING = 1.2
# A share of the places in shadow that leaves nothing to see.
_SHADED = 0.99


@dataclass(frozen=True)
class Seen:
    """What a look shows of a grating: who looks, the places that show it, and the light there if its table is known."""

    by: str
    places: list[Places]
    table: Table | None
    light: SeenLight | None
    look: Look
    pixels: Pixels

    @property
    def things(self) -> list[bpy.types.Object]:
        """The objects that are seen."""
        return list(dict.fromkeys(each.thing for each in self.places))


def seen(subject: Subject, depsgraph: bpy.types.Depsgraph, view: ViewPixels | None) -> Seen | None:
    """Look through a 3D view or, without one, through the scene's camera. None without both."""
    pixels = view or camera_pixels(subject.scene, depsgraph)
    if pixels is None:
        return None
    found = look_through(pixels, subject.scene, depsgraph, rays=_RAYS)
    shown = [each for each in found.places if each.node.node_tree == subject.group and len(each.rays)]
    places = [each for each in shown if not held_out(each.thing, subject.layer)]
    table = table_of(subject.grating)
    light = light_at(subject.scene, places, table) if places and table is not None else None
    return Seen("the 3D view" if view else "the camera", places, table, light, found, pixels)


def unseen(subject: Subject, look: Seen) -> Iterator[Cause]:
    """The camera sees nothing of the grating, or only what no lamp reaches."""
    if any(thing.data.is_editmode for thing in subject.things):
        return
    if not look.places:
        is_away = not any(look.pixels.in_frame(_corners(thing)).any() for thing in subject.things)
        why = "the frame leaves it out" if is_away else "other objects cover it, or it covers no pixel"
        aim = mend("AIM_CAMERA", f"Turn the Camera to {subject.things[0].name}")
        told = f"{look.by.capitalize()} sees nothing of {listed(subject.things)}: {why}."
        yield Cause("NOT_SEEN", told, aim if is_away and look.by == "the camera" else None)


def _corners(thing: bpy.types.Object) -> np.ndarray:
    """The middle and the corners (9, 3) of an object's bounding box in world space."""
    corners = np.array([corner[:] for corner in thing.bound_box])
    matrix = np.array(thing.matrix_world)
    return np.concatenate([corners.mean(axis=0)[None], corners]) @ matrix[:3, :3].T + matrix[:3, 3]


def badly_lit(subject: Subject, look: Seen) -> Iterator[Cause]:
    """Lamps shine, but not so that colours leave towards the camera."""
    light: SeenLight | None = look.light
    lamps: list[bpy.types.ID] = [lamp for lamp in lamps_of(subject.scene) if not why_dark(lamp, subject)]
    if not lamps and subject.scene.world is not None:  # its sources are the lamps
        lamps = [subject.scene.world]
    if light is None or light.coloured_share >= SHARE_MIN:
        return
    if not light.lit.any():
        told = f"No light of {listed(lamps)} reaches the side of {listed(look.things)} that {look.by} sees."
        yield Cause("BEHIND", told, light_button())
    elif light.is_too_weak:
        told = f"The light of {listed(lamps)} on {listed(look.things)} is too weak to show colours."
        yield Cause("TOO_WEAK", told, mend("BRIGHTEN", "Brighten the Lamps"))
    elif light.white_share >= 4 * SHARE_MIN:
        told = f"What {look.by} sees of {listed(look.things)} is lit, but its colours mix to white."
        yield Cause("WHITE", f"{told} A smaller lamp, or one further to the side, parts them.", light_button())
    else:
        told = f"{listed(look.things)} diffracts the light of {listed(lamps)}, but sends no colour to {look.by}"
        yield Cause("NO_ORDER", f"{told}: {_misplaced(look)}.", light_button())


def few_colours(look: Seen) -> Iterator[Cause]:
    """Colours show on a small part only."""
    if look.light is not None and SHARE_MIN <= look.light.coloured_share < _SHARE_FEW:
        told = f"Colours show on only {look.light.coloured_share:.1%} of what {look.by} sees of {listed(look.things)}."
        yield Cause("FEW_COLOURS", f"{told} Further lamps, or a curved surface, show more.", light_button())


def _misplaced(look: Seen) -> str:
    """How the lamp that lights most places should stand."""
    assert look.light is not None and look.table is not None
    distance = float(np.nanmedian(look.light.distance))
    wr = np.concatenate([in_frames(each, each.to_view)[:, 2] for each in look.places])
    nearest, farthest = colour_range(look.table, 2 * float(np.median(wr)))
    if distance < nearest and nearest > _GRAZING * _period_scale(look):
        return "its period is so fine that lamp and camera must both graze the surface"
    if distance < nearest:
        return "the lamp stands too near to its mirror image; move it further to the side"
    if distance > farthest:
        return "the lamp stands too far to the side; move it towards the camera"
    return "the lamp stands along the grooves; turn it around the object"


def _period_scale(look: Seen) -> float:
    return float(np.median([skin_of(each.node).period_scale for each in look.places]))


def outside_bake(subject: Subject, look: Seen) -> Iterator[Cause]:
    """The grating was baked for directions other than those seen now."""
    response = response_in(subject.group)
    region = None if response is None else noted_region(response.group)
    if response is None or region is None:
        return
    shown = joined([look.look.shown(response, each) for each in look.places])
    outside = 0.0 if shown.is_dark else 1 - held_share(shown, region)
    if outside >= _OUTSIDE_MIN:
        told = (
            f"{outside:.0%} of the light that {look.by} sees on {listed(look.things)} is black: "
            f"{subject.grating.name} was baked for another camera or other lamps."
        )
        again = Button("grating.needs", "Bake Every Direction", {"everything": True}, invoked=True)
        yield Cause("OUTSIDE", told, again if subject.grating.source else None)


def shaded(subject: Subject, look: Seen, depsgraph: bpy.types.Depsgraph) -> Iterator[Cause]:
    """All that is seen lies in the shadow of other objects."""
    if not _traces_shadows(subject) or look.light is None or not look.light.lit.any():
        return
    blockers: list[bpy.types.Object | None] = []
    for places in look.places:
        every = max(1, len(places.points) * len(look.places) // _SHADOW_RAYS)
        for sent in sent_to(subject.scene, places):
            wi = in_frames(places, sent.direction)[:, 2]
            lit = np.flatnonzero((wi > 0) & (sent.irradiance > 0))[::every]
            blockers += [_blocker(subject.scene, depsgraph, places, at=at, to=sent.direction[at]) for at in lit]
    blocked = [each for each in blockers if each is not None]
    if blockers and len(blocked) >= _SHADED * len(blockers):
        most = max(dict.fromkeys(blocked), key=blocked.count)
        told = f"What {look.by} sees of {listed(look.things)} lies in the shadow of {most.name}."
        yield Cause("SHADED", told, mend("NO_SHADOWS", "Switch Shadows Off"))


def _traces_shadows(subject: Subject) -> bool:
    """Whether the renderer can find shadows on the diffraction (materials/shadow.py)."""
    cycles = subject.scene.render.engine == "CYCLES" and subject.scene.cycles.shading_system
    return traces_shadows(subject.group) and (compat.HAS_RAYCAST or cycles)


def _blocker(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, places: Places, *, at: int, to: np.ndarray
) -> bpy.types.Object | None:
    """The object that keeps the light from direction `to` off a place, or None."""
    start = places.points[at] + places.frames[at, 2] * 1e-4 * (1 + np.abs(places.points[at]).max())
    hit, _, _, _, thing, _ = scene.ray_cast(depsgraph, Vector(start.tolist()), Vector(to.tolist()))
    is_shade = hit and thing is not None and thing.visible_shadow and not thing.hide_render
    return thing.original if is_shade else None
