# SPDX-License-Identifier: GPL-3.0-or-later
"""The lamps of a light rig: ordinary lamps in a collection of their own."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector

# The kinds of rigs.
SUN, STUDIO, WINDOW, POINTS = "SUN", "STUDIO", "WINDOW", "POINTS"
ORDERS, FLASH, GRID = "ORDERS", "FLASH", "GRID"
# The cone of a spot: its full angle in radians, and the share of it that fades.
_CONE, _FADING = math.radians(40), 0.4
COLLECTION = "Light Rig"
# The property of the collection and of its lamps, saved in files: marks what the next rig replaces.
RIG = "natural_gratings_rig"


def rig_field() -> object:
    """The property of an object or a collection. Blender does not list it among the custom properties."""
    return bpy.props.BoolProperty()  # type: ignore[func-returns-value]  # the stubs say it returns None


@dataclass(frozen=True)
class RigLamp:
    """A lamp that shines at the middle of what it lights.

    kind        SUN, AREA, POINT or SPOT
    sizes       width and height, seen from the middle: as angles in radians for a sun, else over the distance
    to          (3,), the unit vector from the middle to the lamp
    irradiance  at the middle, of a surface that faces the lamp, W/m2
    distance    from the middle, m; a sun only stands there
    is_card     it is only there to be reflected, and leaves matt surfaces as they are"""

    name: str
    kind: str
    sizes: tuple[float, float]
    to: np.ndarray
    irradiance: float
    distance: float
    is_card: bool = False

    @property
    def variance(self) -> float:
        """The variance of the lamp's disc along one axis, seen from the middle, rad2."""
        return variance_of(self.kind, self.sizes)

    @property
    def strength(self) -> float:
        """The lamp's strength in Blender's unit: W/m2 for a sun, else W.

        A point lamp of P watts gives P / (4 pi d^2) at the distance d. An area lamp of P watts and the area A of its
        face has the radiance P / (pi A). A disc of this area gives P / (pi d^2 + A) along its axis."""
        if self.kind == "SUN":
            return self.irradiance
        squared = self.distance**2
        if self.kind in {"POINT", "SPOT"}:
            return 4 * math.pi * squared * self.irradiance
        return self.irradiance * squared * (math.pi + self.sizes[0] * self.sizes[1])


def variance_of(kind: str, sizes: tuple[float, float]) -> float:
    """The variance along one axis of a disc, or the mean variance of a rectangle."""
    width, height = sizes
    return (width**2 + height**2) / 24 if kind == "AREA" else width * height / 16


def is_of_rig(thing: bpy.types.Object | bpy.types.Collection) -> bool:
    """Whether an object is a lamp of a light rig, or a collection that of its lamps."""
    return bool(getattr(thing, RIG, False))


def is_card(lamp: bpy.types.Object) -> bool:
    """Whether a lamp of a light rig is only there to be reflected."""
    return is_of_rig(lamp) and not lamp.visible_diffuse


def replace_rig(scene: bpy.types.Scene, lamps: Sequence[RigLamp], middle: np.ndarray) -> list[bpy.types.Object]:
    """Remove the lamps of the scene's former rig, and add these. Returns the added objects."""
    collection = _collection_of(scene)
    for former in list(filter(is_of_rig, collection.objects)):
        data = former.data
        bpy.data.objects.remove(former)
        if data is not None and not data.users:
            bpy.data.batch_remove([data])
    return [_add(collection, lamp, middle) for lamp in lamps]


def _collection_of(scene: bpy.types.Scene) -> bpy.types.Collection:
    """The scene's collection of rig lamps, made if missing."""
    for each in scene.collection.children_recursive:
        if each.library is None and is_of_rig(each):
            return each
    made = bpy.data.collections.new(COLLECTION)
    setattr(made, RIG, True)
    scene.collection.children.link(made)
    return made


def _add(collection: bpy.types.Collection, lamp: RigLamp, middle: np.ndarray) -> bpy.types.Object:
    data = bpy.data.lights.new(lamp.name, lamp.kind)  # type: ignore[arg-type]  # the stubs list the names
    data.energy = lamp.strength
    width, height = (size * lamp.distance for size in lamp.sizes)
    if lamp.kind == "SUN":
        data.angle = lamp.sizes[0]
    elif lamp.kind in {"POINT", "SPOT"}:
        data.shadow_soft_size = width / 2
        if lamp.kind == "SPOT":
            data.spot_size, data.spot_blend = _CONE, _FADING
    else:
        data.shape, data.size, data.size_y = "RECTANGLE", width, height
    made = bpy.data.objects.new(lamp.name, data)
    setattr(made, RIG, True)
    to = Vector(lamp.to.tolist())
    made.location = Vector(middle.tolist()) + lamp.distance * to
    made.rotation_euler = to.to_track_quat("Z", "Y").to_euler()
    made.visible_camera = False  # a lamp should not stand in the picture
    if lamp.is_card:
        made.visible_diffuse = made.visible_volume_scatter = False  # for Cycles
        data.diffuse_factor = data.volume_factor = 0.0  # for EEVEE
    collection.objects.link(made)
    return made
