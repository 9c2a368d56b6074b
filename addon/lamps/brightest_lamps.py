# SPDX-License-Identifier: GPL-3.0-or-later
"""The lamps of a scene: which of them light diffraction, by how strongly they light objects, and which of their
features are not supported.

The strength ignores shadows and the direction of spots and area lamps: lamps may turn, but a render chooses them only
once."""

import math
from collections.abc import Callable, Sequence

import bpy
import numpy as np

from ..blender import compat
from .rendered_lamps import rendered

# Finds the bounding boxes (n, 2, 3) of what the lamps light. Called only if there are too many lamps.
LitBoxes = Callable[[bpy.types.Scene], np.ndarray]
# How many lamps have names (lamp_drivers.py). Files contain the names, so the number is the same in all Blenders.
LAMPS_MAX = 32
# Each lamp costs some time in every pixel, so only the brightest are used.
FOLLOWED_MAX = min(LAMPS_MAX, compat.LAMPS_IN_CYCLES)
# Lamps that the artist leaves out are shown to nodes that sample light at random, up to this many.
LEFT_OUT_MAX = 8
# The largest number of left-out lamps that a warning names.
_NAMED_MAX = 8
# A lamp replaces a followed one only if it is brighter by more than this factor. Otherwise, a lamp moving where two are
# equally bright would rewrite drivers at each step. The factor is about half a photographic stop, or 22 % in distance.
_LEAD = 1.5
# Custom property of lamp data, saved in files: marks a Diffraction Lamp (materials/diffraction_lamp.py).
DIFFRACTION_LAMP = "ng_fan"
# The property of an object, saved in files: whether the artist keeps a lamp among those that light diffraction, leaves
# it out, or lets the extension choose. It belongs to the object, because lamps may share their data.
COUNTS = "natural_gratings_counts"
AUTO, KEPT, LEFT_OUT = "AUTO", "KEPT", "LEFT_OUT"


def counts_field() -> object:
    """The property of an object. Blender does not list it among the object's custom properties."""
    choices = [(name, name, "") for name in (AUTO, KEPT, LEFT_OUT)]
    return bpy.props.EnumProperty(items=choices)  # type: ignore[func-returns-value]  # the stubs say it returns None


def lamps_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """All lamps of the scene, including hidden ones, which may be shown later. Diffraction Lamps are not counted."""
    return [o for o in scene.collection.all_objects if o.type == "LIGHT" and not is_fan(o)]


def is_fan(lamp: bpy.types.Object) -> bool:
    """Whether a lamp is a Diffraction Lamp. Its light has already been diffracted."""
    return DIFFRACTION_LAMP in lamp.data


def is_kept(lamp: bpy.types.Object) -> bool:
    """Whether the artist keeps a lamp among those that light diffraction."""
    return getattr(lamp, COUNTS, AUTO) == KEPT


def is_left_out(lamp: bpy.types.Object) -> bool:
    """Whether the artist leaves a lamp out."""
    return getattr(lamp, COUNTS, AUTO) == LEFT_OUT


def lamps_left_out(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The lamps that the artist leaves out, in the panel's order."""
    return _in_order([lamp for lamp in lamps_of(scene) if is_left_out(lamp)])


def _in_order(lamps: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """Suns first, then by strength, then by name."""
    return sorted(lamps, key=lambda o: (o.data.type != "SUN", -o.data.energy, o.name))


def brightest(
    scene: bpy.types.Scene, *, followed: Sequence[bpy.types.Object] = (), lit: LitBoxes | None = None
) -> list[bpy.types.Object]:
    """The lamps that light diffraction, at most FOLLOWED_MAX, in the panel's order. The artist's left-out lamps do not.

    If there are more, kept lamps come first, then lamps visible in the render, then the ones that send the most light
    to the boxes that `lit` finds. A followed lamp is replaced only by a clearly brighter one."""
    lamps = [lamp for lamp in lamps_of(scene) if not is_left_out(lamp)]
    if len(lamps) > FOLLOWED_MAX:
        lamps = _chosen(scene, lamps, set(followed), lit)
    return _in_order(lamps)


def _chosen(
    scene: bpy.types.Scene, lamps: list[bpy.types.Object], followed: set[bpy.types.Object], lit: LitBoxes | None
) -> list[bpy.types.Object]:

    strengths = irradiances(lamps, lit(scene) if lit is not None else ()).tolist()
    order = [
        (not is_kept(lamp), not shown, -strength * (_LEAD if lamp in followed else 1.0), lamp.name, index)
        for index, (lamp, shown, strength) in enumerate(zip(lamps, rendered(scene, lamps), strengths, strict=True))
    ]
    return [lamps[index] for *_, index in sorted(order)[:FOLLOWED_MAX]]


def instanced_lamps(depsgraph: bpy.types.Depsgraph) -> list[str]:
    """The names of lamps that are instanced by collections or particles.

    An instanced lamp is one object at many places, and drivers cannot follow all of them."""
    if not _may_be_instanced(list(bpy.data.lights)):
        return []
    instances = [i.object.original for i in depsgraph.object_instances if i.is_instance and i.object.type == "LIGHT"]
    return sorted({lamp.name for lamp in instances if not is_fan(lamp)})


def _may_be_instanced(lights: list[bpy.types.Light]) -> bool:
    """Whether instances may show a lamp of the file: something other than a scene or a collection uses it or its
    collection, or a parent of it is an instancer. Avoids a slow search through all instances."""
    found: set[bpy.types.ID] = set(lights)
    pending = found
    while pending:
        users = set().union(*bpy.data.user_map(subset=pending).values()) - found
        lamps = {user for user in users if isinstance(user, bpy.types.Object) and user.type == "LIGHT"}
        holders = {user for user in users if isinstance(user, bpy.types.Collection)}
        if users - lamps - holders - set(bpy.data.scenes) or any(map(_has_instancer_above, lamps)):
            return True
        pending = lamps | holders
        found |= pending
    return False


def _has_instancer_above(thing: bpy.types.Object) -> bool:
    while (thing := thing.parent) is not None:
        if thing.is_instancer:
            return True
    return False


def instances_are_not_followed(names: list[str]) -> str:
    """The warning that names instanced lamps and the remedy."""
    return f"instanced lamps do not light diffraction: {', '.join(names)}; use Object > Apply > Make Instances Real"


def unfollowed_features(scene: bpy.types.Scene, counted: Sequence[bpy.types.Object]) -> list[str]:
    """One warning line for each lamp feature that diffraction does not support, and one that names the lamps not among
    `counted`, if the render shows them. Lamps that the artist leaves out need no warning."""
    lamps = [lamp for lamp in lamps_of(scene) if not is_left_out(lamp)]
    lines = []
    if len(lamps) > FOLLOWED_MAX:
        left_out = [lamp for lamp in lamps if lamp not in counted]
        names = sorted(lamp.name for lamp, shown in zip(left_out, rendered(scene, left_out), strict=True) if shown)
        if names:
            listed = [*names[:_NAMED_MAX], f"and {len(names) - _NAMED_MAX} more"] if len(names) > _NAMED_MAX else names
            told = f"diffraction uses at most {FOLLOWED_MAX} lamps; left out: {', '.join(listed)}"
            lines.append(f"{told}; choose lamps in the panel's step Light")
    for lamp in lamps:
        if _has_own_nodes(lamp.data):
            lines.append(f"{lamp.name}: its shader nodes are ignored")
        if lamp.data.type == "AREA" and lamp.data.spread < math.pi - 1e-3:
            lines.append(f"{lamp.name}: its spread is ignored")
    return lines


def _has_own_nodes(lamp: bpy.types.Light) -> bool:
    """Whether the lamp has nodes other than the white emission of strength 1 that every lamp has."""
    tree = compat.lamp_nodes(lamp)
    nodes = tree.nodes if tree is not None else ()
    return not all(n.type == "OUTPUT_LIGHT" or _is_plain_emission(n) for n in nodes)


def _is_plain_emission(node: bpy.types.Node) -> bool:
    if node.type != "EMISSION":
        return False
    colour, strength = node.inputs["Color"], node.inputs["Strength"]
    is_white = tuple(colour.default_value) == (1, 1, 1, 1) and strength.default_value == 1
    return is_white and not colour.is_linked and not strength.is_linked


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
    """The luminance of `power` (lamp_drivers.py): a sun's irradiance, W/m2, or another lamp's radiant intensity,
    W/sr; its absolute value for lamps of negative strength."""
    red, green, blue = light.color
    if light.use_temperature:
        heat = light.temperature_color
        red, green, blue = red * heat[0], green * heat[1], blue * heat[2]
    luminance = LUMINANCE[0] * red + LUMINANCE[1] * green + LUMINANCE[2] * blue
    return abs(light.energy * 2.0**light.exposure * luminance * _per_watt(light, x_scale, y_scale))


def _per_watt(light: bpy.types.Light, x_scale: float, y_scale: float) -> float:
    """The factor from a lamp's strength to `power`, as a number; lamp_drivers.py has the same formula as an
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
