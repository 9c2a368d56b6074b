# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's lamps as properties of the scene, kept by drivers.

Materials read them with the Attribute node (View Layer). The drivers are simple expressions: Blender evaluates them
with auto-run of scripts off and without this extension, so whatever is done to a lamp is followed, and a material that
is appended to another scene follows that scene's lamps.

`ng_key_<i>_` and its three numbers, then a fourth:

    place   unit vector to a sun; position of another lamp, m
            mean variance of its disc along one axis, m2; for a sun minus one minus that, rad2
    power   linear RGB: a sun's irradiance, W/m2; another's radiant intensity along its axis, W/sr
            its own x over its y scale; negative if it casts no shadow
    z       its axis z over its squared length
            cosine of the angle off its axis from which a spot begins to shine; 3 for an area lamp, -3 for others
    x       its axis x over its squared length
            cosine of the angle within which it shines in full; 2 for an area lamp, -2 for others: all round

Four properties, and not more: EEVEE looks each up in a loop of its own for every pixel, and the software rasteriser's
compiler takes minutes over twenty such loops.
"""

import contextlib
import math
import re
from collections.abc import Iterator

import bpy
from bpy.app.handlers import persistent

from ..precompute.failure import GratingError
from . import compat

# More would cost every pixel: the brightest are kept.
KEYS_MAX = 8
PROPERTIES = ("place", "power", "z", "x")
# On an object: 1 where light linking keeps the lamp from it.
UNLINKED = "unlinked"


def property_name(index: int, what: str) -> str:
    return f"ng_key_{index}_{what}"


def _lamps(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    return [o for o in scene.objects if o.type == "LIGHT"]


def find_lamps(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """All lamps of the scene, also hidden ones (they may be shown later), brightest kind first, then by name.

    Raises GratingError if there is none."""
    lamps = _lamps(scene)
    if not lamps:
        instanced = instanced_lamps(bpy.context.evaluated_depsgraph_get()) if bpy.context.scene == scene else []
        if instanced:
            raise GratingError(f"scene {scene.name}: {instances_are_not_followed(instanced)}")
        raise GratingError(f"scene {scene.name}: no lamp lights it; add a Sun lamp, then assign again")
    return sorted(lamps, key=lambda o: (o.data.type != "SUN", -o.data.energy, o.name))


def instanced_lamps(depsgraph: bpy.types.Depsgraph) -> list[str]:
    """Names of the lamps that instances of collections and particles show: one object with many places, which no
    driver follows."""
    found = {i.object.original.name for i in depsgraph.object_instances if i.is_instance and i.object.type == "LIGHT"}
    return sorted(found)


def instances_are_not_followed(names: list[str]) -> str:
    return f"instanced lamps do not light diffraction: {', '.join(names)}; use Object > Apply > Make Instances Real"


def followed_lamps(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The lamps that the scene's properties follow, as their drivers say."""
    drivers = scene.animation_data.drivers if scene.animation_data else ()
    found = {}
    for curve in drivers:
        for index in range(KEYS_MAX):
            # The fourth number's driver may read the lamp's data alone, not its object.
            if curve.array_index == 0 and curve.data_path == f'["{property_name(index, "place")}"]':
                found[index] = curve.driver.variables[0].targets[0].id
    return [found[index] for index in sorted(found)]


def follow_lamps(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Make the scene's properties follow its lamps, KEYS_MAX at most; those followed.

    Raises GratingError if there is no lamp."""
    lamps = find_lamps(scene)[:KEYS_MAX]
    stop_following(scene)
    for index, lamp in enumerate(lamps):
        _follow(scene, index, lamp)
        _mark_unlinked(scene, index, lamp)
    return lamps


def stop_following(scene: bpy.types.Scene) -> None:
    """Remove the drivers and the properties."""
    names = [name for i in range(KEYS_MAX) for name in (property_name(i, what) for what in PROPERTIES) if name in scene]
    for name in names:
        scene.driver_remove(f'["{name}"]')
        del scene[name]


def lamp_count(scene: bpy.types.Scene) -> int:
    """How many lamps the scene's properties tell of."""
    return sum(property_name(index, "place") in scene for index in range(KEYS_MAX))


def is_up_to_date(scene: bpy.types.Scene) -> bool:
    """Whether the properties follow just the lamps that the scene has."""
    lamps = _lamps(scene)
    followed = followed_lamps(scene)
    return len(followed) == min(len(lamps), KEYS_MAX) and all(lamp in lamps for lamp in followed)


def unfollowed_features(scene: bpy.types.Scene) -> list[str]:
    """What of the lamps diffraction does not follow, a line for each."""
    lamps = _lamps(scene)
    lines = []
    if len(lamps) > KEYS_MAX:
        lines.append(f"{len(lamps) - KEYS_MAX} lamps too many: the first {KEYS_MAX} are used")
    for lamp in lamps:
        if _has_own_nodes(lamp.data):
            lines.append(f"{lamp.name}: its shader nodes are not followed")
        if lamp.data.type == "AREA" and lamp.data.spread < math.pi - 1e-3:
            lines.append(f"{lamp.name}: its spread is not followed")
    return lines


def _has_own_nodes(lamp: bpy.types.Light) -> bool:
    """Whether the lamp's nodes are more than the white emission of strength 1 that every lamp has."""
    tree = compat.lamp_nodes(lamp)
    nodes = tree.nodes if tree is not None else ()
    return not all(n.type == "OUTPUT_LIGHT" or _is_plain_emission(n) for n in nodes)


def _is_plain_emission(node: bpy.types.Node) -> bool:
    if node.type != "EMISSION":
        return False
    colour, strength = node.inputs["Color"], node.inputs["Strength"]
    is_white = tuple(colour.default_value) == (1, 1, 1, 1) and strength.default_value == 1
    return is_white and not colour.is_linked and not strength.is_linked


def _follow(scene: bpy.types.Scene, index: int, lamp: bpy.types.Object) -> None:
    kind, data = lamp.data.type, lamp.data
    axes = {f"{name}{i}": f"matrix_world[{axis}][{i}]" for axis, name in enumerate("xyz") for i in range(3)}
    shown, holders = _visibility(scene, lamp)
    size = _size_variables(data)
    light = {"energy": "energy", "exposure": "exposure", "heated": "use_temperature", "normalized": "normalize"}
    light |= {f"c{i}": f"color[{i}]" for i in range(3)} | {f"t{i}": f"temperature_color[{i}]" for i in range(3)}
    light |= size | {"shadow": "use_shadow"}
    variance = _variance(data)
    # A lamp shines along its own -Z: a sun lies along +Z.
    place = [f"z{i} / max({_length('z')}, 1e-30)" for i in range(3)] if kind == "SUN" else "abc"
    position = {name: f"matrix_world[3][{i}]" for i, name in enumerate("abc")}
    strength = f"{shown} * energy * pow(2, exposure) * {_per_watt(data)}"
    power = (f"{strength} * c{i} * (t{i} if heated else 1)" for i in range(3))
    outer, inner = {"AREA": ("3", "2")}.get(kind, ("-3", "-2"))
    if kind == "SPOT":
        outer = "cos(cone / 2)"
        # At blend 0 the rim is sharp: a width that single precision still tells from none.
        inner = f"{outer} + max((1 - {outer}) * blend, 1e-5)"
    cone = {"cone": "spot_size", "blend": "spot_blend"} if kind == "SPOT" else {}
    drive = _Drive(scene, index, lamp)
    drive("place", (*place, f"-1 - {variance}" if kind == "SUN" else variance), axes | position, size)
    drive("power", (*power, f"{_length('x')} / max({_length('y')}, 1e-9) * (2 * shadow - 1)"),
          {"hidden": "hide_render"} | axes, light, holders)  # fmt: skip
    drive("z", (*(f"z{i} / max(pow({_length('z')}, 2), 1e-30)" for i in range(3)), outer), axes, cone)
    drive("x", (*(f"x{i} / max(pow({_length('x')}, 2), 1e-30)" for i in range(3)), inner), axes, cone)


class _Drive:
    """Makes a property of the scene and drives it by what a lamp's object and its data hold."""

    def __init__(self, scene: bpy.types.Scene, index: int, lamp: bpy.types.Object):
        self.scene, self.index, self.lamp = scene, index, lamp

    def __call__(self, what: str, expressions, of_object: dict[str, str], of_data: dict[str, str], others=()) -> None:
        name = property_name(self.index, what)
        self.scene[name] = [0.0] * 4
        variables = [(key, "OBJECT", self.lamp, path) for key, path in of_object.items()]
        variables += [(key, "LIGHT", self.lamp.data, path) for key, path in of_data.items()]
        for i, expression in enumerate(expressions):
            driver = self.scene.driver_add(f'["{name}"]', i).driver
            driver.type = "SCRIPTED"
            words = set(re.findall(r"[a-z_]+[0-9]*", expression))
            for variable in (*variables, *others):
                if variable[0] in words:
                    _add_variable(driver, *variable)
            driver.expression = _compact(expression)


def _visibility(scene: bpy.types.Scene, lamp: bpy.types.Object) -> tuple[str, list]:
    """Expression for 1 where the render shows the lamp, else 0, and the variables of the collections that it is in:
    it is shown if it is not hidden and all collections down one way to it are not."""
    holders: dict[bpy.types.Collection, str] = {}
    ways = []
    for way in _ways(scene.collection, lamp):
        for collection in way:
            holders.setdefault(collection, f"h{len(holders)}")
        ways.append(" * ".join(f"(1 - {holders[collection]})" for collection in way) or "1")
    variables = [(name, "COLLECTION", collection, "hide_render") for collection, name in holders.items()]
    anyone = ways[0] if len(ways) == 1 else f"max({', '.join(ways)})"
    return f"(1 - hidden) * {anyone}", variables


def _ways(
    collection: bpy.types.Collection, lamp: bpy.types.Object, above: tuple[bpy.types.Collection, ...] = ()
) -> Iterator[tuple[bpy.types.Collection, ...]]:
    """The chains of collections under the scene's own that lead to a lamp."""
    if lamp.name in collection.objects and collection.objects[lamp.name] == lamp:
        yield above
    for child in collection.children:
        yield from _ways(child, lamp, (*above, child))


def _per_watt(lamp: bpy.types.Light) -> str:
    """What a lamp's strength is multiplied by to give `power`. Blender's point and spot lamps of P watts have a
    radiant intensity of P / (4 pi) W/sr, its area lamps P / pi along their axis, a sun's strength is its irradiance; a
    lamp that is not normalized has so much for each unit of its area (a point: of its sphere's; a sun: of its disc's
    solid angle)."""
    pi = f"{math.pi:.9f}"
    if lamp.type == "SUN":
        return f"(1 if normalized else {pi} * pow(sin(min(angle, {pi}) / 2), 2))"
    if lamp.type in {"POINT", "SPOT"}:
        return f"(1 / (4 * {pi}) if normalized else radius * radius)"
    share = "1" if lamp.shape in {"SQUARE", "RECTANGLE"} else f"{math.pi / 4:.9f}"
    return f"(1 if normalized else {share} * {_side('x', 'width')} * {_side('y', _height(lamp))}) / {pi}"


def _variance(lamp: bpy.types.Light) -> str:
    """Expression for the mean variance along one axis: a disc of radius r has r^2 / 4, a side s has s^2 / 12."""
    if lamp.type == "SUN":
        return "pow(sin(min(angle, 3.14159265) / 2), 2) / 4"
    if lamp.type in {"POINT", "SPOT"}:
        return "radius * radius / 4"
    squares = f"(pow({_side('x', 'width')}, 2) + pow({_side('y', _height(lamp))}, 2))"
    return f"{squares} / {24 if lamp.shape in {'SQUARE', 'RECTANGLE'} else 32}"


def _height(lamp: bpy.types.Light) -> str:
    return "height" if lamp.shape in {"RECTANGLE", "ELLIPSE"} else "width"


def _side(axis: str, length: str) -> str:
    return f"{length} * {_length(axis)}"


def _length(axis: str) -> str:
    return f"sqrt({axis}0 * {axis}0 + {axis}1 * {axis}1 + {axis}2 * {axis}2)"


def _size_variables(lamp: bpy.types.Light) -> dict[str, str]:
    if lamp.type == "SUN":
        return {"angle": "angle"}
    if lamp.type in {"POINT", "SPOT"}:
        return {"radius": "shadow_soft_size"}
    return {"width": "size", "height": "size_y"}


def _compact(expression: str) -> str:
    """Without the blanks about operators: a driver's expression ends at 255 characters."""
    return re.sub(r" ?([-+*/,]) ?", r"\1", expression)


def _add_variable(driver: bpy.types.Driver, name: str, kind: str, holder: bpy.types.ID, path: str) -> None:
    variable = driver.variables.new()
    variable.name = name
    variable.targets[0].id_type = kind
    variable.targets[0].id = holder
    variable.targets[0].data_path = path


def _mark_unlinked(scene: bpy.types.Scene, index: int, lamp: bpy.types.Object) -> None:
    """Light linking: mark the objects that the lamp does not light. Its list may name those lit, or those not."""
    name = property_name(index, UNLINKED)
    receivers = lamp.light_linking.receiver_collection
    for mesh in scene.objects:
        if receivers is not None and mesh.type != "LIGHT" and not _receives(receivers, mesh):
            mesh[name] = 1.0
        elif name in mesh:
            del mesh[name]


def _receives(receivers: bpy.types.Collection, mesh: bpy.types.Object) -> bool:
    states = {}
    for item, entry in zip(receivers.objects, receivers.collection_objects, strict=True):
        states[item] = entry.light_linking.link_state
    for child, entry in zip(receivers.children, receivers.collection_children, strict=True):
        for item in child.all_objects:
            states.setdefault(item, entry.light_linking.link_state)
    if mesh in states:
        return states[mesh] == "INCLUDE"
    # As Blender has it: a list that includes nobody leaves out just whom it excludes.
    return "INCLUDE" not in states.values() and bool(states)


@persistent
def follow_after_import(*_) -> None:
    """After an append or a link of diffraction: a scene that follows no lamps yet does so now, and no object keeps the
    light linking of the file that it came from."""
    from .materials.diffraction import is_diffraction, show_key_lights  # materials build on this module

    if not any(is_diffraction(group) for group in bpy.data.node_groups):
        return
    for scene in bpy.data.scenes:
        if scene.library is None:
            _follow_or_mark(scene)
    show_key_lights()


def _follow_or_mark(scene: bpy.types.Scene) -> None:
    followed = followed_lamps(scene)
    for index, lamp in enumerate(followed):
        if lamp is not None and lamp.type == "LIGHT":
            _mark_unlinked(scene, index, lamp)
    if not followed:
        with contextlib.suppress(GratingError):  # no lamp yet: the panel says so
            follow_lamps(scene)
