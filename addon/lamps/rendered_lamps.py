# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lamps light the picture: lamps that the render does not show do not diffract.

Drivers follow what can be animated: `hide_render` of the lamp and of its collections, its glossy visibility and its
scale. Drivers cannot follow whether a view layer excludes the lamp's collections. A property of each view layer holds
this (`ng_key_shown`, one number for each lamp, absent if all are 1). While a window is open, the property also holds
whether an eye or monitor icon hides the lamp in the viewport. Renders and saved files ignore this, as in Blender."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, TypeVar

import bpy

from ..blender import stored
from .drivers import VIEW_LAYER, Drivers, Variable

_SHOWN = "ng_key_shown"
# Lamp types that Blender ignores if their size along one of their axes is zero.
_WITH_EXTENT = {"AREA", "SPOT"}
_Held = TypeVar("_Held", bpy.types.Collection, bpy.types.LayerCollection)


def drive_on(drivers: Drivers, index: int, lamp: bpy.types.Object, *, name: str) -> bool:
    """Drive the property `name`: 1 if the render shows the lamp, else 0. Return whether anything changed."""
    collections: dict[bpy.types.Collection, str] = {}
    hidden = []
    for way in _ways(drivers.scene.collection, set(lamp.users_collection)):
        # Each chain starts with the scene's own collection, which cannot be hidden.
        names = [collections.setdefault(collection, f"h{len(collections)}") for collection in way[1:]]
        hidden.append(f"max({', '.join(names)})" if len(names) > 1 else names[0] if names else "0")
    factors = ["visible", "(1 - hidden)", f"(1 - min({', '.join(hidden)}))" if hidden else "0"]
    variables = [Variable(name, collection, "hide_render") for collection, name in collections.items()]
    variables += [Variable("hidden", lamp, "hide_render"), Variable("visible", lamp, "visible_glossy")]
    if drivers.holder == drivers.scene:  # view layers store only the lamps that the scene follows
        factors.insert(0, "shown")
        variables.append(Variable("shown", VIEW_LAYER, f'["{_SHOWN}"][{index}]', otherwise=1.0))
    if lamp.data.type in _WITH_EXTENT:
        for axis, letter in enumerate("xyz"):
            cells = [f"{letter}{i}" for i in range(3)]
            variables += [Variable(cell, lamp, f"matrix_world[{axis}][{i}]") for i, cell in enumerate(cells)]
            factors.append(f"({' + '.join(f'{cell} * {cell}' for cell in cells)} > 0)")
    return drivers.drive(name, [" * ".join(factors)], variables)


def note_shown(scene: bpy.types.Scene, lamps: Sequence[bpy.types.Object], *, in_viewport: bool) -> bool:
    """Store in each view layer which lamps it shows. Return whether anything changed.

    `in_viewport`: lamps that only the viewport hides count as hidden."""
    changed = False
    for layer in scene.view_layers:
        wanted = _shown(layer, lamps)
        if in_viewport:
            wanted = [shown * lamp.visible_get(view_layer=layer) for shown, lamp in zip(wanted, lamps, strict=True)]
        if all(wanted):
            if _SHOWN in layer:
                del layer[_SHOWN]
                changed = True
        elif stored.numbers(layer, _SHOWN, len(wanted)) != tuple(wanted):
            layer[_SHOWN] = wanted
            changed = True
    return changed


def show_as_rendered(scene: bpy.types.Scene, lamps: Sequence[bpy.types.Object]) -> None:
    """Show lamps again that only the viewport hides.

    Also called outside Blender's main thread, so numbers change in place and no memory is allocated or freed."""
    for layer in scene.view_layers:
        if stored.has_floats(layer, _SHOWN, len(lamps)):
            for index, shown in enumerate(_shown(layer, lamps)):
                layer[_SHOWN][index] = shown


def rendered(scene: bpy.types.Scene, lamps: Sequence[bpy.types.Object]) -> list[bool]:
    """For each lamp, whether a render of some view layer shows it. A hidden lamp counts as shown if the property that
    hides it is animated, because it may be visible in another frame."""
    held = _in_shown_collections(scene)
    return [(held is None or lamp in held) and _renders(lamp) for lamp in lamps]


def _in_shown_collections(scene: bpy.types.Scene) -> set[bpy.types.Object] | None:
    """The objects in collections that some view layer renders; None if all collections are rendered."""
    met, shown = set(), set()
    pending = [(layer.layer_collection, False) for layer in scene.view_layers]
    while pending:
        held, hidden = pending.pop()
        collection = held.collection
        hidden = hidden or (collection.hide_render and not _is_animated(collection, "hide_render"))
        met.add(collection)
        if not (hidden or held.exclude):
            shown.add(collection)
        pending += [(child, hidden) for child in held.children]
    return None if shown == met else {thing for collection in shown for thing in collection.objects}


def _renders(lamp: bpy.types.Object) -> bool:
    """Whether a render shows a lamp, given that it shows the lamp's collections."""
    if lamp.hide_render and not _is_animated(lamp, "hide_render"):
        return False
    if not lamp.visible_glossy and not _is_animated(lamp, "visible_glossy"):
        return False
    has_extent = lamp.data.type not in _WITH_EXTENT or all(lamp.matrix_world.to_scale())
    return has_extent or _is_animated(lamp, "scale")


def _is_animated(holder: bpy.types.ID, path: str) -> bool:
    """Whether keyframes or a driver control a property of a data-block."""
    animation = getattr(holder, "animation_data", None)
    if animation is None:
        return False
    strips = [strip for track in animation.nla_tracks for strip in track.strips]
    curves = [*animation.drivers, *(curve for each in (animation, *strips) for curve in _keyed(each))]
    return any(curve.data_path == path for curve in curves)


def _keyed(holder: bpy.types.AnimData | bpy.types.NlaStrip) -> Iterator[bpy.types.FCurve]:
    """The F-curves of an action in the slot that its user has chosen."""
    if holder.action is not None:
        bags = (bag for layer in holder.action.layers for strip in layer.strips for bag in strip.channelbags)
        yield from (curve for bag in bags if bag.slot == holder.action_slot for curve in bag.fcurves)


def _shown(layer: bpy.types.ViewLayer, lamps: Sequence[bpy.types.Object]) -> list[float]:
    """For each lamp 1, or 0 if the view layer excludes it. A lamp in several collections is shown if one of them is; of
    a lamp with an excluded collection, only the current `hide_render` of the others counts."""
    # A new scene's layer has no collections until Blender updates it, so none is excluded.
    if layer.layer_collection is None or not any(way[-1].exclude for way in _ways(layer.layer_collection)):
        return [1.0] * len(lamps)
    return [float(_is_in(layer, lamp)) for lamp in lamps]


def _is_in(layer: bpy.types.ViewLayer, lamp: bpy.types.Object) -> bool:
    ways = list(_ways(layer.layer_collection, set(lamp.users_collection)))
    included = [way for way in ways if not way[-1].exclude]
    return included == ways or any(not any(held.collection.hide_render for held in way) for way in included)


def _ways(
    held: _Held, holders: set[bpy.types.Collection] | None = None, above: tuple[_Held, ...] = ()
) -> Iterator[tuple[_Held, ...]]:
    """The chains of nested collections, or of a view layer's collections, to each holder; without holders, to all."""
    way: tuple[_Held, ...] = above + (held,)
    if holders is None or getattr(held, "collection", held) in holders:
        yield way
    children: Iterable[Any] = held.children
    for child in children:
        yield from _ways(child, holders, way)
