# SPDX-License-Identifier: GPL-3.0-or-later
"""Looks through the scene's camera: which directions of each grating it shows, and which parts of the scene may change
from frame to frame."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...precompute.bake.shown_directions import Shown, joined, least_change, under_everything, under_lamp
from ...precompute.table.radiance import Skin
from ..gratings.grating import LAMPS_ONLY
from ..lamps.irradiance import lamps_sent
from ..materials.group_properties import lights_of, variation_of
from ..materials.material import linked_among, number_in
from ..materials.response import HEIGHT_SCALE, IOR, PERIOD_SCALE, ROUGHNESS, Response, responses_in
from ..materials.skin import answers_to_world
from .seen_surfaces import Pixels, Places, boxes_with_gratings, seen_by

# Inputs of a Diffraction node. A link to one may change which part of the table is read.
_LINKABLE = ("Normal", "Tangent", "Rotation", "Roughness", "Period Scale", "Height Scale")
# Every fourth ray also samples its neighbour pixels.
_NEIGHBOURS = 4
# A grating whose direction varies is sampled at this many angles, at most 15 degrees apart. (u, v) is at most 2 long,
# so between two angles it leaves their range by at most 0.017, less than the margin of the needs (MARGIN).
_TURNS = 13


@dataclass(frozen=True)
class Look:
    """The result of one look. The first `count` rays go through pixel centres. With footprints, every fourth of them
    has a ray through the pixel to its right; these rays come next, and then the rays through the pixels above."""

    scene: bpy.types.Scene
    places: list[Places]
    count: int

    def shown(self, response: Response, places: Places) -> Shown:
        """What the camera sees of a response at places; empty where the places show another response."""
        if response not in responses_in(places.node.node_tree):
            return joined([])
        middle = places.rays < self.count
        skin = skin_of(places.node)
        wr = in_frames(places, places.to_view)
        turn = variation_of(places.node.node_tree).turn
        angles = np.linspace(-turn, turn, _TURNS) if turn else (0.0,)
        if answers_to_everything(places.node.node_tree):
            return joined([under_everything(turned(wr[middle], angle), skin=skin) for angle in angles])
        parts = []
        for sent in lamps_sent(self.scene, places.thing, places.points):
            wi = in_frames(places, sent.direction)
            footprint = self._footprint(places, (wi + wr)[:, :2])
            for angle in angles:
                parts.append(
                    under_lamp(
                        turned(wr[middle], angle), turned(wi[middle], angle), irradiance=sent.irradiance[middle],
                        variance=sent.variance[middle], skin=skin, footprint=footprint[middle],
                    )
                )  # fmt: skip
        return joined(parts)

    def _footprint(self, places: Places, uv: np.ndarray) -> np.ndarray:
        """The smallest change of (u, v) (n, 2) across each place's pixel, (n,). NaN without neighbour rays on the same
        object."""
        further = -(-self.count // _NEIGHBOURS)
        # The extra entry at the end, -1, stands for rays that were not cast.
        row = np.full(self.count + 2 * further + 1, -1)
        row[places.rays] = np.arange(len(places.rays))
        has = (places.rays < self.count) & (places.rays % _NEIGHBOURS == 0)
        number = self.count + places.rays // _NEIGHBOURS
        beside, above = (row[np.where(has, number + step, -1)] for step in (0, further))
        return np.where((beside >= 0) & (above >= 0), least_change(uv, uv[beside], uv[above]), np.nan)


def look(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, *, rays: int, footprints: bool = False) -> Look | None:
    """Cast about `rays` rays through the evaluated scene's camera, towards meshes with gratings. None without a
    camera."""
    pixels = camera_pixels(scene, depsgraph)
    return None if pixels is None else look_through(pixels, scene, depsgraph, rays=rays, footprints=footprints)


def camera_pixels(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> Pixels | None:
    """The pixels of the scene's camera, or None."""
    if scene.camera is None or scene.camera.type != "CAMERA":  # Blender accepts any object as the scene's camera
        return None
    return Pixels(scene, scene.camera.evaluated_get(depsgraph))


def look_through(
    pixels: Pixels, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, *, rays: int, footprints: bool = False
) -> Look:
    """Cast about `rays` rays through pixels, towards meshes with gratings."""
    window = pixels.window_of(boxes_with_gratings(depsgraph))
    if window is None:
        return Look(scene, [], 0)
    at = pixels.places(window, rays)
    count = len(at)
    if footprints:
        some = at[::_NEIGHBOURS]
        at = np.concatenate([at, some + (1 / pixels.size[0], 0), some + (0, 1 / pixels.size[1])])
    return Look(scene, seen_by(scene, depsgraph, pixels.rays(at)), count)


def answers_to_everything(group: bpy.types.NodeTree) -> bool:
    """Whether a Diffraction group responds to light from all directions, not only to lamps."""
    return lights_of(group) != LAMPS_ONLY and answers_to_world(group)


def unknown_inputs(node: bpy.types.Node) -> list[str]:
    """The inputs of a Diffraction node whose links only a renderer can evaluate."""
    return linked_among(node, _LINKABLE)


def skin_of(node: bpy.types.Node) -> Skin:
    """The settings of a Diffraction node that change what the relief reflects."""
    return Skin(*(number_in(node, socket.name) for socket in (ROUGHNESS, PERIOD_SCALE, HEIGHT_SCALE, IOR)))


def in_frames(places: Places, directions: np.ndarray) -> np.ndarray:
    """World-space directions (n, 3), expressed in the places' tangent frames (T, B, N)."""
    return np.einsum("nij,nj->ni", places.frames, directions)


def turned(directions: np.ndarray, angle: float) -> np.ndarray:
    """Directions (n, 3) in tangent frames that are rotated by `angle` (radians) from T towards B."""
    x, y, z = directions.T
    return np.stack([np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x, z], axis=1)


# Modifiers that can move a mesh without keyframes.
_BY_THEMSELVES = {
    "CLOTH", "SOFT_BODY", "FLUID", "DYNAMIC_PAINT", "OCEAN", "WAVE", "MESH_SEQUENCE_CACHE", "MESH_CACHE", "NODES",
    "PARTICLE_SYSTEM", "EXPLODE", "BUILD",
}  # fmt: skip


def moves(things: Iterable[bpy.types.Object]) -> bool:
    """Whether one of the objects, or an object that it depends on, may change from frame to frame."""
    pending, seen = list(things), set()
    while pending:
        thing = pending.pop()
        if thing in seen:
            continue
        seen.add(thing)
        if any(map(is_animated, _blocks(thing))) or any(m.type in _BY_THEMSELVES for m in thing.modifiers):
            return True
        pending += _leads_to(thing)
    return False


def frames_between(first: int, last: int, most: int) -> list[int]:
    """At most `most` evenly spaced frames, including `first` and `last`."""
    count = min(most, last - first + 1)
    return sorted({first + round(k * (last - first) / max(count - 1, 1)) for k in range(count)})


def _blocks(thing: bpy.types.Object) -> Iterator[bpy.types.ID]:
    yield thing
    if thing.data is not None:
        yield thing.data
        if getattr(thing.data, "shape_keys", None) is not None:
            yield thing.data.shape_keys


def is_animated(block: Any) -> bool:
    """Whether keyframes, NLA strips or drivers change a data-block."""
    held = block.animation_data
    return held is not None and bool(held.action or held.nla_tracks or held.drivers)


def _leads_to(thing: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """The objects that the object's parent, constraints and modifiers point to."""
    held = [thing, *thing.constraints, *thing.modifiers]
    if thing.pose is not None:
        held += [constraint for bone in thing.pose.bones for constraint in bone.constraints]
    for one in held:
        named = [
            own for own in one.bl_rna.properties if own.type == "POINTER" and own.fixed_type.identifier == "Object"
        ]
        yield from filter(None, (getattr(one, own.identifier) for own in named))
