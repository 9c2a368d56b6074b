# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding a light rig: lamps at the places from which the camera sees the most of a grating's colours."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ....precompute.base.failure import GratingError
from ....precompute.measure.best_lamp_directions import (
    Lamp,
    Preference,
    Radiance,
    Seen,
    colours_at,
    covering,
    two_best,
)
from ....precompute.table.atlas import read
from ....precompute.table.radiance import Skin, lamp_radiance
from ....precompute.table.table import Table
from ...cameras.camera_look import skin_of
from ...cameras.seen_surfaces import Pixels, boxes_with_gratings, rays_that_hit, seen_by, seen_from
from ...gratings.grating import LAMPS_ONLY
from ...lamps.light_rig import FLASH, GRID, ORDERS, POINTS, STUDIO, SUN, WINDOW, RigLamp, replace_rig
from ...materials.group_properties import lights_of, variation_of
from ...materials.material import linked_among, on_objects
from ..finding_bakes import bake_of, bake_shown_by
from .adding_diffraction_lamps import shows_grating
from .lighting import update_lamps
from .reflections import cards, lacks_reflections
from .rig_places import Lit, across, beside_camera, beside_lens, to_view

# Rays that search the objects; patches that are scored, and for Orders; places from which shadows are sought.
_RAYS, _PATCHES, _MORE_PATCHES, _SHADOW_PLACES = 4000, 80, 240, 12
# The side of a patch over the picture's width, within which an eye mixes colours, and the rays through a patch, over
# its side.
_PATCH = 1 / 300
_IN_PATCH = np.stack(np.meshgrid((-1, 0, 1), (-1, 0, 1)), axis=-1).reshape(-1, 2) / 3
# The key's irradiance in W/m2. A diffuse surface of 50 % grey that faces the key has the radiance 0.5 E / pi, here 0.4.
_KEY = 0.8 * math.pi
# The distance of lamps from the middle, in radii of the objects' bounding box.
_FAR = 4.0
# The weights of directions: from below in the picture (1 from above); from the camera itself, which looks flat (1 from
# the side); for lamps that light nothing else of what is seen; for lamps that stand in the picture; for lamps that
# other objects hide.
_BELOW, _FLAT, _DARK, _IN_PICTURE, _SHADED = 0.6, 0.7, 0.3, 0.5, 0.3
# The kind and the sizes of a rig's key. A lamp larger than 9 degrees in radius would light diffraction with noise.
_KEYS = {
    SUN: ("SUN", (math.radians(2), math.radians(2))),
    STUDIO: ("AREA", (0.16, 0.16)),
    WINDOW: ("AREA", (0.12, 0.24)),
    POINTS: ("POINT", (0.02, 0.02)),
    ORDERS: ("SUN", (math.radians(4.5), math.radians(4.5))),
    FLASH: ("AREA", (0.03, 0.03)),
    GRID: ("SPOT", (0.14, 0.14)),
}
_FILL_SIZES = (0.2, 0.2)
# The irradiance of further lamps, over the key's.
_SECOND, _FILL, _BOUNCE = 0.4, 0.1, 0.15
# The lamps of Orders, and the factors on the key's irradiance among which each is chosen; a dark skin's orders are
# faint.
# The albedo of the skin under a dielectric relief, which washes its colours out.
_ORDERS = ("Order Light", "Second Order Light", "Third Order Light")
_FACTORS, _UNDER = (0.5, 1.0, 2.0, 4.0, 8.0), 0.08
# Inputs of a Diffraction node that turn its direction.
_TURNING = ("Tangent", "Rotation")
# The golden ratio's fraction, whose multiples are spread evenly.
_GOLDEN = (math.sqrt(5) - 1) / 2
# The length of shadow rays to a sun, m.
_NO_END = 1e6


# What a search for directions needs (best_lamp_directions.py).
_Search = tuple[list[Seen], Lamp, Preference]


@dataclass(frozen=True)
class Rig:
    """An artist's choice: a kind (light_rig.py), a factor on the lamps' strength, and one on their size."""

    kind: str = SUN
    strength: float = 1.0
    softness: float = 1.0


def add_light_rig(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, rig: Rig, *, objects: Sequence[bpy.types.Object],
    view: bpy.types.RegionView3D | None = None,
    from_view: bool = False,
) -> list[str]:  # fmt: skip
    """Replace the scene's light rig by one for the grating on these objects, as the scene's camera sees it, or a 3D
    view if asked by `from_view` or if the scene has no camera. Returns lines to report. Raises GratingError, with
    nothing changed, if there is neither, if the objects show no grating, if a bake is lost, or if no light shows
    colours."""
    pixels = seen_from(scene, depsgraph, view, from_view=from_view)
    if not objects:
        raise GratingError(f"scene {scene.name}", "no object shows a grating", "press Assign to Selected")
    patches = _MORE_PATCHES if rig.kind == ORDERS else _PATCHES
    lit = _lit(scene, depsgraph, pixels, objects=objects, patches=patches)
    kind, sizes = _KEYS[rig.kind]
    key = RigLamp("Key", kind, _softer(sizes, rig.softness), pixels.up, _KEY, _FAR * lit.radius)
    if rig.kind == FLASH and pixels.lens is not None:
        key = replace(key, distance=float(np.linalg.norm(pixels.lens - lit.middle)))
    distance = math.inf if kind == "SUN" else key.distance
    tables = {group: _table_of(scene, group) for group in {each.node.node_tree for each in lit.places}}
    seen = _seen(lit, tables, counts_under=rig.kind == ORDERS)
    lamp = Lamp(key.irradiance, key.variance, distance)
    if rig.kind == FLASH:
        lamps = [_flash(rig, key, seen, lamp, at=beside_lens(pixels, lit))]
    else:
        shadows = _Shadows(scene, depsgraph, lit, distance=distance)
        if rig.kind == ORDERS:
            lamps = _orders(rig, key, (seen, lamp, shadows.prefer))
        else:
            prefer = _preference(pixels, lit, shadows, distance=distance)
            lamps = _lamps(rig, key, (seen, lamp, prefer), pixels=pixels, lit=lit)
    if not lamps:
        raise GratingError(
            objects[0].name, "no lamp position shows its colours to the camera", "turn the object or the camera"
        )
    metal = [each for each in lit.places if _mirrors(each.node.node_tree, tables)]
    if metal and lacks_reflections(scene, Vector(lit.middle.tolist())):
        key = replace(key, irradiance=_KEY * rig.strength, distance=_FAR * lit.radius)
        shadows = _Shadows(scene, depsgraph, lit, distance=key.distance)
        prefer = _preference(pixels, lit, shadows, distance=key.distance)
        lamps += cards(replace(lit, places=metal), key, prefer)
    added = replace_rig(scene, lamps, lit.middle)
    update_lamps(scene)
    names = [lamp.name for lamp in added]
    return [f"Light Rig: {' and '.join(filter(None, (', '.join(names[:-1]), names[-1])))}. {on_objects(list(objects))}"]


def carriers(scene: bpy.types.Scene, active: bpy.types.Object | None) -> list[bpy.types.Object]:
    """The objects that a rig lights: the active object if it shows a grating, else all of the scene that do."""
    if active is not None and shows_grating(active):
        return [active]
    return [thing for thing in scene.objects if shows_grating(thing)]


def _lit(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, pixels: Pixels, *, objects: Sequence[bpy.types.Object],
    patches: int,
) -> Lit:  # fmt: skip
    """What the picture shows of the gratings on these objects, at about this many patches. Raises GratingError if that
    is nothing."""
    boxes = list(boxes_with_gratings(depsgraph, objects))
    window = pixels.window_of(boxes)
    at = np.zeros((0, 2)) if window is None else pixels.places(window, _RAYS)
    hit = rays_that_hit(scene, depsgraph, pixels.rays(at), things=objects)
    within = _PATCH * _IN_PATCH * (1, pixels.size[0] / pixels.size[1])
    at = at[hit[:: max(1, len(hit) // patches)], None] + within
    found = seen_by(scene, depsgraph, pixels.rays(at.reshape(-1, 2)))
    found = [each for each in found if each.thing.original in objects]
    if not found:
        fault = "the camera sees nothing of its grating"
        raise GratingError(objects[0].name, fault, "turn the camera to it, or check its UV map")
    corners = np.concatenate([_corners(*box) for box in boxes])
    radius = float(np.linalg.norm(corners.max(axis=0) - corners.min(axis=0))) / 2
    return Lit(found, np.concatenate([each.points for each in found]).mean(axis=0), max(radius, 1e-6))


def _corners(corners: np.ndarray, matrix: Matrix) -> np.ndarray:
    """The corners (8, 3) of a box in world space."""
    world = np.array(matrix)
    return corners @ world[:3, :3].T + world[:3, 3]


def _seen(lit: Lit, tables: Mapping[bpy.types.NodeTree, Table], *, counts_under: bool) -> list[Seen]:
    """The places with what their gratings show, and if asked what lies under a dielectric."""
    return [
        Seen(
            each.points - lit.middle, each.to_view, _turned(each.frames, _turn_of(each.node)),
            each.rays // len(_IN_PATCH), _radiance(tables[each.node.node_tree], skin_of(each.node)),
            _UNDER if counts_under and not tables[each.node.node_tree].holds_reflectance else 0.0,
        )
        for each in lit.places
    ]  # fmt: skip


def _table_of(scene: bpy.types.Scene, group: bpy.types.NodeTree) -> Table:
    """The table of the bake that a Diffraction group shows, of a varied one its own. Raises GratingError if it is
    lost."""
    owner = next((grating for grating in scene.natural_gratings.items if grating.group == group), None)
    return read(bake_shown_by(group) if owner is None else bake_of(owner))[0]


def _mirrors(group: bpy.types.NodeTree, tables: Mapping[bpy.types.NodeTree, Table]) -> bool:
    """Whether what a Diffraction group shows besides lamps is mostly reflected by a metal or by films."""
    return tables[group].holds_reflectance and lights_of(group) != LAMPS_ONLY


def _radiance(table: Table, skin: Skin) -> Radiance:
    """What a bake shows under a lamp."""
    return lambda wi, wr, irradiance, variance: lamp_radiance(
        table, wi, wr, irradiance=irradiance[:, None], variance=variance, skin=skin
    )


def _turn_of(node: bpy.types.Node) -> float:
    """The largest turn of a grating's direction at unknown places, in radians: that of its variation, or any if links
    set the direction, as for a hologram."""
    return math.pi if linked_among(node, _TURNING) else variation_of(node.node_tree).turn


def _turned(frames: np.ndarray, most: float) -> np.ndarray:
    """Tangent frames (n, 3, 3), each turned about its normal by another angle of at most `most` to either side."""
    angles = most * (2 * (np.arange(len(frames)) * _GOLDEN % 1) - 1)
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    t, b, n = (frames[:, k] for k in range(3))
    return np.stack([cos * t + sin * b, cos * b - sin * t, n], axis=1)


class _Shadows:
    """Which share of the seen places the scene's objects shade from a lamp."""

    def __init__(self, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, lit: Lit, *, distance: float) -> None:
        self._scene, self._depsgraph, self._distance = scene, depsgraph, distance
        points, normals = (
            np.concatenate(each) for each in zip(*((p.points, p.frames[:, 2]) for p in lit.places), strict=True)
        )
        step = max(1, len(points) // _SHADOW_PLACES)
        self._middle, self._normals = lit.middle, normals[::step]
        # A little above the surface, so that a ray does not hit where it begins.
        self._points = points[::step] + 1e-3 * lit.radius * self._normals

    def clear(self, directions: np.ndarray) -> np.ndarray:
        """The share (m,), of the places that face a lamp in each of these directions (m, 3), to which it shines."""
        return np.array([self._share(direction) for direction in directions])

    def prefer(self, directions: np.ndarray) -> np.ndarray:
        """The weights (m,) of lamps in these directions (m, 3), which other objects hide or not."""
        return _SHADED + (1 - _SHADED) * self.clear(directions)

    def _share(self, direction: np.ndarray) -> float:
        points = self._points[self._normals @ direction > 0]
        if math.isinf(self._distance):
            rays = np.broadcast_to(direction, points.shape)
            reach = np.full(len(points), _NO_END)
        else:
            rays = self._middle + self._distance * direction - points
            reach = np.linalg.norm(rays, axis=1)
            rays = rays / reach[:, None]
        shaded = [
            self._is_shaded(Vector(point), Vector(ray), length)
            for point, ray, length in zip(points.tolist(), rays.tolist(), reach.tolist(), strict=True)
        ]
        return 1 - sum(shaded) / max(len(shaded), 1)

    def _is_shaded(self, point: Vector, ray: Vector, length: float) -> bool:
        hit, _, _, _, thing, _ = self._scene.ray_cast(self._depsgraph, point, ray, distance=length)
        return hit and not thing.hide_render and thing.visible_shadow


def _preference(pixels: Pixels, lit: Lit, shadows: _Shadows, *, distance: float) -> Preference:
    """The weights of directions for a lamp: rather from above in the picture and from the side, so that it also lights
    the surface's own colour, not in the picture, and not behind other objects."""
    axis = to_view(lit)
    normals = np.concatenate([each.frames[:, 2] for each in lit.places])

    def prefer(directions: np.ndarray) -> np.ndarray:
        above = (1 + directions @ pixels.up) / 2
        weight = _BELOW + (1 - _BELOW) * above
        weight = weight * (1 - (1 - _FLAT) * np.maximum(directions @ axis, 0) ** 2)
        weight = weight * (_DARK + (1 - _DARK) * np.maximum(directions @ normals.T, 0).mean(axis=1))
        if not math.isinf(distance):
            weight = weight * np.where(pixels.shows(lit.middle + distance * directions), _IN_PICTURE, 1.0)
        return weight * shadows.prefer(directions)

    return prefer


def _flash(rig: Rig, key: RigLamp, seen: list[Seen], lamp: Lamp, *, at: np.ndarray) -> RigLamp:
    """The flash at the one of the directions (n, 3) that shows the most colour. The camera fixes its place, so it
    stands there even if it shows none."""
    best = int(np.argmax(colours_at(seen, at, lamp).mean(axis=1)))
    return replace(key, name="Flash", to=at[best], irradiance=_KEY * rig.strength)


def _orders(rig: Rig, key: RigLamp, search: _Search) -> list[RigLamp]:
    """Wide suns that show colour at the most places; empty if no direction shows colour."""
    seen, lamp, prefer = search
    found = covering(seen, lamp, prefer, most=len(_ORDERS), factors=_FACTORS)
    return [
        replace(key, name=name, to=chosen.direction, irradiance=_KEY * rig.strength * factor)
        for name, (chosen, factor) in zip(_ORDERS, found, strict=False)
    ]


def _lamps(rig: Rig, key: RigLamp, search: _Search, *, pixels: Pixels, lit: Lit) -> list[RigLamp]:
    """The lamps of a rig, with the key at the best direction; empty if no direction shows colour."""
    found = two_best(*search)
    if found is None:
        return []
    first, second = (each.direction for each in found)
    key = replace(key, to=first, irradiance=_KEY * rig.strength)
    soft = _softer(_FILL_SIZES, rig.softness)

    def further(name: str, to: np.ndarray, share: float, *, sizes: tuple[float, float] = key.sizes) -> RigLamp:
        return replace(key, name=name, to=to, irradiance=share * key.irradiance, sizes=sizes)

    if rig.kind == STUDIO:
        return [
            replace(key, name="Soft Box"), further("Second Soft Box", second, _SECOND),
            further("Fill", beside_camera(pixels, lit, first), _FILL, sizes=soft),
        ]  # fmt: skip
    if rig.kind == WINDOW:
        return [replace(key, name="Window"), further("Bounce", across(pixels, lit, first), _BOUNCE, sizes=soft)]
    if rig.kind == GRID:
        fill = further("Fill", beside_camera(pixels, lit, first), _FILL)
        return [replace(key, name="Gridded Soft Box"), fill]
    if rig.kind == POINTS:
        return [replace(key, name="First Point"), further("Second Point", second, 1.0)]
    return [replace(key, name="Rig Sun")]


def _softer(sizes: tuple[float, float], factor: float) -> tuple[float, float]:
    return sizes[0] * factor, sizes[1] * factor
