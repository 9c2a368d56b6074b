# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of what the 3D view, or the camera where the artist looks through it, sees of the grating."""

from collections.abc import Iterator
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector

from ...precompute.bake.shown_directions import held_share, joined
from ...precompute.table.table import Table
from ..blender import compat
from ..cameras.camera_look import Look, camera_pixels, in_frames, look_through, skin_of
from ..cameras.camera_rays import Pixels
from ..cameras.seen_surfaces import Places
from ..cameras.view_rays import ViewPixels
from ..gratings.baked_region import noted_region
from ..lamps.find import lamps_of
from ..materials.group_properties import traces_shadows
from ..materials.group_users import listed
from ..materials.response import response_in
from .cause import Button, Cause, light_button, mend
from .lamp_causes import why_dark
from .seen_light import SHARE_MIN, SeenLight, colour_range, light_at, sent_to, table_of
from .subject import Subject

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
    places = [each for each in found.places if each.node.node_tree == subject.group and len(each.rays)]
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
