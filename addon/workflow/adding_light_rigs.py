# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding a light rig: lamps at the places from which the camera sees the most of a grating's colours."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...precompute.base.failure import GratingError
from ...precompute.measure.light_directions import Chosen, Lamp, Preference, Radiance, Seen, two_best
from ...precompute.table.atlas_file import read
from ...precompute.table.radiance import Skin, lamp_radiance
from ...precompute.table.table import Table
from ..cameras.camera_look import skin_of
from ..cameras.camera_rays import Pixels
from ..cameras.seen_surfaces import Places, boxes_with_gratings, rays_that_hit, seen_by
from ..cameras.view_rays import seen_from
from ..lamps.light_rig import POINTS, STUDIO, SUN, WINDOW, RigLamp, replace_rig
from ..materials.group_properties import variation_of
from ..materials.group_users import on_objects
from ..materials.material import linked_among
from .adding_diffraction_lamps import shows_grating
from .following_lamps import update_lamps
from .restoring_bakes import bake_of, bake_shown_by

# Rays that search the objects; patches that are scored; places from which shadows are sought.
_RAYS, _PATCHES, _SHADOW_PLACES = 2000, 80, 12
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
}
_FILL_SIZES = (0.2, 0.2)
# The irradiance of further lamps, over the key's.
_SECOND, _FILL, _BOUNCE = 0.4, 0.1, 0.15
# Inputs of a Diffraction node that turn its direction.
_TURNING = ("Tangent", "Rotation")
# The golden ratio's fraction, whose multiples are spread evenly.
_GOLDEN = (math.sqrt(5) - 1) / 2
# The length of shadow rays to a sun, m.
_NO_END = 1e6


@dataclass(frozen=True)
class Rig:
    """An artist's choice: a kind (light_rig.py), a factor on the lamps' strength, and one on their size."""

    kind: str = SUN
    strength: float = 1.0
    softness: float = 1.0


@dataclass(frozen=True)
class _Lit:
    """What a rig lights: places that the camera sees, their middle in world space, and the radius of their objects."""

    places: list[Places]
    middle: np.ndarray
    radius: float


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
    lit = _lit(scene, depsgraph, pixels, objects=objects)
    kind, sizes = _KEYS[rig.kind]
    key = RigLamp("Key", kind, _softer(sizes, rig.softness), pixels.up, _KEY, _FAR * lit.radius)
    distance = math.inf if kind == "SUN" else key.distance
    shadows = _Shadows(scene, depsgraph, lit, distance=distance)
    lamp = Lamp(key.irradiance, key.variance, distance)
    found = two_best(_seen(scene, lit), lamp, _preference(pixels, lit, shadows, distance=distance))
    if found is None:
        raise GratingError(
            objects[0].name, "no lamp position shows its colours to the camera", "turn the object or the camera"
        )
    lamps = _lamps(rig, key, found, pixels=pixels, lit=lit)
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
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, pixels: Pixels, *, objects: Sequence[bpy.types.Object]
) -> _Lit:
    """What the picture shows of the gratings on these objects. Raises GratingError if that is nothing."""
    boxes = list(boxes_with_gratings(depsgraph, objects))
    window = pixels.window_of(boxes)
    at = np.zeros((0, 2)) if window is None else pixels.places(window, _RAYS)
    hit = rays_that_hit(scene, depsgraph, pixels.rays(at), things=objects)
    within = _PATCH * _IN_PATCH * (1, pixels.size[0] / pixels.size[1])
    at = at[hit[:: max(1, len(hit) // _PATCHES)], None] + within
    found = seen_by(scene, depsgraph, pixels.rays(at.reshape(-1, 2)))
    found = [each for each in found if each.thing.original in objects]
    if not found:
        fault = "the camera sees nothing of its grating"
        raise GratingError(objects[0].name, fault, "turn the camera to it, or check its UV map")
    corners = np.concatenate([_corners(*box) for box in boxes])
    radius = float(np.linalg.norm(corners.max(axis=0) - corners.min(axis=0))) / 2
    return _Lit(found, np.concatenate([each.points for each in found]).mean(axis=0), max(radius, 1e-6))


def _corners(corners: np.ndarray, matrix: Matrix) -> np.ndarray:
    """The corners (8, 3) of a box in world space."""
    world = np.array(matrix)
    return corners @ world[:3, :3].T + world[:3, 3]


def _seen(scene: bpy.types.Scene, lit: _Lit) -> list[Seen]:
    """The places with what their gratings show. Raises GratingError if a bake is lost."""
    tables = {group: _table_of(scene, group) for group in {each.node.node_tree for each in lit.places}}
    return [
        Seen(
            each.points - lit.middle, each.to_view, _turned(each.frames, _turn_of(each.node)),
            each.rays // len(_IN_PATCH), _radiance(tables[each.node.node_tree], skin_of(each.node)),
        )
        for each in lit.places
    ]  # fmt: skip


def _table_of(scene: bpy.types.Scene, group: bpy.types.NodeTree) -> Table:
    """The table of the bake that a Diffraction group shows, of a varied one its own."""
    owner = next((grating for grating in scene.natural_gratings.items if grating.group == group), None)
    return read(bake_shown_by(group) if owner is None else bake_of(owner))[0]


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

    def __init__(self, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, lit: _Lit, *, distance: float) -> None:
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


def _preference(pixels: Pixels, lit: _Lit, shadows: _Shadows, *, distance: float) -> Preference:
    """The weights of directions for a lamp: rather from above in the picture and from the side, so that it also lights
    the surface's own colour, not in the picture, and not behind other objects."""
    to_view = _to_view(lit)
    normals = np.concatenate([each.frames[:, 2] for each in lit.places])

    def prefer(directions: np.ndarray) -> np.ndarray:
        above = (1 + directions @ pixels.up) / 2
        weight = _BELOW + (1 - _BELOW) * above
        weight = weight * (1 - (1 - _FLAT) * np.maximum(directions @ to_view, 0) ** 2)
        weight = weight * (_DARK + (1 - _DARK) * np.maximum(directions @ normals.T, 0).mean(axis=1))
        if not math.isinf(distance):
            weight = weight * np.where(pixels.shows(lit.middle + distance * directions), _IN_PICTURE, 1.0)
        return weight * (_SHADED + (1 - _SHADED) * shadows.clear(directions))

    return prefer


def _lamps(rig: Rig, key: RigLamp, found: tuple[Chosen, Chosen], *, pixels: Pixels, lit: _Lit) -> list[RigLamp]:
    """The lamps of a rig, with the key at the first direction found."""
    first, second = (each.direction for each in found)
    key = replace(key, to=first, irradiance=_KEY * rig.strength)
    soft = _softer(_FILL_SIZES, rig.softness)

    def further(name: str, to: np.ndarray, share: float, *, sizes: tuple[float, float] = key.sizes) -> RigLamp:
        return replace(key, name=name, to=to, irradiance=share * key.irradiance, sizes=sizes)

    if rig.kind == STUDIO:
        return [
            replace(key, name="Soft Box"), further("Second Soft Box", second, _SECOND),
            further("Fill", _beside_camera(pixels, lit, first), _FILL, sizes=soft),
        ]  # fmt: skip
    if rig.kind == WINDOW:
        return [replace(key, name="Window"), further("Bounce", _across(pixels, lit, first), _BOUNCE, sizes=soft)]
    if rig.kind == POINTS:
        return [replace(key, name="First Point"), further("Second Point", second, 1.0)]
    return [replace(key, name="Rig Sun")]


def _softer(sizes: tuple[float, float], factor: float) -> tuple[float, float]:
    return sizes[0] * factor, sizes[1] * factor


def _to_view(lit: _Lit) -> np.ndarray:
    """The unit vector (3,) from the middle to the viewer."""
    mean = np.concatenate([each.to_view for each in lit.places]).mean(axis=0)
    return mean / max(np.linalg.norm(mean), 1e-9)


def _beside_camera(pixels: Pixels, lit: _Lit, key: np.ndarray) -> np.ndarray:
    """The direction of a fill: from above the camera and beside it, on the side away from the key."""
    side = -1.0 if key @ pixels.right > 0 else 1.0
    return _above_floor(_to_view(lit) + 0.4 * side * pixels.right + 0.3 * pixels.up)


def _across(pixels: Pixels, lit: _Lit, key: np.ndarray) -> np.ndarray:
    """The direction of a bounce: the key's, mirrored to the other side of the picture, at least 40 degrees from its
    middle."""
    across = key @ pixels.right
    side = -1.0 if across > 0 else 1.0
    level = key - across * pixels.right
    level = level / max(np.linalg.norm(level), 1e-9)
    least = math.sin(math.radians(40))
    across = max(abs(across), least)
    return _above_floor(side * across * pixels.right + math.sqrt(max(1 - across**2, 0.0)) * level)


def _above_floor(direction: np.ndarray) -> np.ndarray:
    """A unit vector (3,) near a direction, at least 5 degrees above the horizon."""
    direction = direction / max(np.linalg.norm(direction), 1e-9)
    raised = np.array([*direction[:2], max(direction[2], math.sin(math.radians(5)))])
    return raised / np.linalg.norm(raised)
