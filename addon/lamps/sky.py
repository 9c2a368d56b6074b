# SPDX-License-Identifier: GPL-3.0-or-later
"""The sources of a scene's world, stored and keyed in properties of the scene; the nodes that read them; and a sun lamp
in place of the disc of the world's Sky Texture.

A source is a compact bright part of the world, such as the sun in a sky or a window in an HDRI. The surface treats it
as a sun. The properties of source `i` are named `ng_world_<i>_<what>` and have no drivers. When the world changes, the
sources are removed (workflow/lights/fitting_worlds.py), and the closures take over all light of the world. The sources
of an animated world have a key in each fitted frame; in other frames they have no light. Each value is constant until
the next key, so a frame never shows a mixture of the sources of two others.

    place   unit vector to the source; -1 - its variance in rad2 along one axis
    power   its irradiance, W/m2, in the scene's linear RGB; 1, because shadow rays go to its centre
    spectrum  one number: the row of the nearest black body or daylight in the table of lamps; absent if all sources are
              white

EEVEE draws a Sky Texture without its disc, so there the disc lights nothing but gratings. The sun lamp lights
everything, in both engines."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Vector

from ..blender import compat, stored
from ..blender.working_space import working_space
from ..nodes.builder import Operand, Tree
from .lamp_group import FAR, Light, read_number, read_property

if TYPE_CHECKING:
    from ...precompute.world_sources.sources import Source


_CONSTANT = 0  # the interpolation's number in Blender
# The beginning of the names of all of the scene's properties here. Saved .blend files contain them, so they must not
# change.
_PREFIX = "ng_world_"


def key_values(scene: bpy.types.Scene, name: str, keys: Sequence[tuple[int, Sequence[float]]]) -> None:
    """Key a custom property of the scene, a list of numbers that exists: frames, and the values from there on.

    Raises RuntimeError if the scene's animation cannot be edited."""
    path = f'["{name}"]'
    for index in range(len(keys[0][1])):
        scene.keyframe_insert(path, index=index, frame=keys[0][0])
        curve = next(curve for _, curve in _curves(scene) if curve.data_path == path and curve.array_index == index)
        points = curve.keyframe_points
        points.add(len(keys) - len(points))
        points.foreach_set("co", [each for frame, values in keys for each in (float(frame), float(values[index]))])
        points.foreach_set("interpolation", [_CONSTANT] * len(keys))
        curve.update()


def remove_keys(scene: bpy.types.Scene) -> bool:
    """Remove the keys of all sources, and the action if nothing else is in it. Return whether there were any."""
    found = [(bag, curve) for bag, curve in _curves(scene) if curve.data_path.startswith(f'["{_PREFIX}')]
    for bag, curve in found:
        bag.fcurves.remove(curve)
    if found and not any(True for _ in _curves(scene)):
        action = scene.animation_data.action
        scene.animation_data.action = None
        if not action.users:
            bpy.data.actions.remove(action)
    return bool(found)


def _curves(scene: bpy.types.Scene) -> Iterator[tuple[bpy.types.ActionChannelbag, bpy.types.FCurve]]:
    action = scene.animation_data.action if scene.animation_data is not None else None
    if action is None or action.library is not None:
        return
    for layer in action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                yield from ((bag, curve) for curve in bag.fcurves)


# Each source costs time in every pixel of the material.
SOURCES_MAX = 8
# Properties of the scene for the fit: the world's fingerprint, and the share of bright, compact light in no source.
_FINGERPRINT, _MISSED = f"{_PREFIX}fingerprint", f"{_PREFIX}missed"
# The fitted frames of an animated world, each with the start of the world's fingerprint there: "1:0f2a 2:77b1".
_FRAMES, _DIGITS = f"{_PREFIX}frames", 16
_FRAME = re.compile("-?[0-9]{1,7}")
SPECTRUM = "spectrum"
# Property of the scene: the row of the rest of its world; absent if that is white, and for an animated world.
REST_SPECTRUM = f"{_PREFIX}rest_spectrum"
_ALWAYS = ("place", "power")
# The values of a source's properties.
_Values = dict[str, list[float]]


def hold_sources(
    scene: bpy.types.Scene, sources: Sequence[Source], *, fingerprint: str, missed: float,
    rest: Sequence[float] = (1.0, 1.0, 1.0),
) -> None:  # fmt: skip
    """Store a fit with at most SOURCES_MAX sources. `rest` is the light of everything else, of any scale."""
    forget_sources(scene)
    if row := _row(rest):
        scene[REST_SPECTRUM] = [row]
    held = [_values(source) for source in sources[:SOURCES_MAX]]
    for index, values in enumerate(held):
        for what in _needed(held):
            scene[source_name(index, what)] = values[what]
    scene[_FINGERPRINT], scene[_MISSED] = fingerprint, float(missed)
    scene.update_tag()


def hold_frames(
    scene: bpy.types.Scene, frames: Mapping[int, Sequence[Source]], *, fingerprints: Mapping[int, str], missed: float
) -> None:
    """Store the sources of an animated world: at most SOURCES_MAX in each frame, and the world's fingerprint there.

    Raises RuntimeError if the scene's animation cannot be edited."""
    forget_sources(scene)
    most = min(max(map(len, frames.values())), SOURCES_MAX)
    held = {frame: [_values(source) for source in sources[:most]] for frame, sources in frames.items()}
    for index in range(most):
        for what in _needed([values for each in held.values() for values in each]):
            keys = list(_keys(held, index, what))
            scene[source_name(index, what)] = list(keys[0][1])
            key_values(scene, source_name(index, what), keys)
    scene[_FRAMES] = " ".join(f"{frame}:{fingerprints[frame][:_DIGITS]}" for frame in sorted(frames))
    scene[_MISSED] = float(missed)
    scene.update_tag()


def _keys(frames: Mapping[int, Sequence[_Values]], index: int, what: str) -> Iterator[tuple[int, Sequence[float]]]:
    """The keys of one property: the values of each fitted frame, and none before and after it."""
    none = [0.0] * (1 if what == SPECTRUM else 4)
    yield min(frames) - 1, none
    for frame, sources in sorted(frames.items()):
        yield frame, sources[index][what] if index < len(sources) else none
        if frame + 1 not in frames:
            yield frame + 1, none


def _row(rgb: Sequence[float]) -> float:
    """The row of a light's colour in the table of lamps."""
    from ...precompute.colour.channels import nearest_row

    return nearest_row(rgb, working_space())


def _values(source: Source) -> _Values:
    irradiance = list(map(float, source.irradiance))
    return {
        "place": [*map(float, source.direction), -1.0 - float(source.variance)],
        "power": [*irradiance, 1.0],
        SPECTRUM: [_row(irradiance)],
    }


def _needed(sources: Sequence[_Values]) -> tuple[str, ...]:
    """The properties that some sources need: white ones need no spectrum."""
    return _ALWAYS if all(values[SPECTRUM] == [0.0] for values in sources) else (*_ALWAYS, SPECTRUM)


def coloured_sources(scene: bpy.types.Scene) -> bool:
    """Whether a source of the scene, or the rest of its world, has another spectrum than white."""
    return REST_SPECTRUM in scene or any(source_name(index, SPECTRUM) in scene for index in range(SOURCES_MAX))


def notes_frames(scene: bpy.types.Scene) -> bool:
    """Whether the scene has a record of fitted frames, sound or not."""
    return _FRAMES in scene


def fitted_frames(scene: bpy.types.Scene) -> dict[int, str]:
    """The fitted frames of an animated world, and the start of its fingerprint in each; empty if there are none."""
    pairs = [each.partition(":") for each in stored.text(scene, _FRAMES).split()]
    found = {int(frame): text for frame, _, text in pairs if _FRAME.fullmatch(frame)}
    return found if _is_whole(scene) else {}


def is_fitted_frame(scene: bpy.types.Scene, fingerprint: str) -> bool:
    """Whether the animated world has this fingerprint in the present frame, or the frame is not fitted."""
    noted = fitted_frames(scene).get(scene.frame_current, "")
    return fingerprint.startswith(noted) or scene.frame_subframe != 0


def forget_sources(scene: bpy.types.Scene) -> bool:
    """Remove all stored sources. Return whether there were any."""
    remove_keys(scene)
    names = [source_name(index, what) for index in range(SOURCES_MAX) for what in (*_ALWAYS, SPECTRUM)]
    present = [name for name in (*names, REST_SPECTRUM, _FINGERPRINT, _MISSED, _FRAMES) if name in scene]
    for name in present:
        del scene[name]
    if present:
        scene.update_tag()
    return bool(present)


def source_count(scene: bpy.types.Scene) -> int:
    """The number of sources that the scene stores."""
    return sum(source_name(index, "place") in scene for index in range(SOURCES_MAX))


def fitted_world(scene: bpy.types.Scene) -> str:
    """The fingerprint of the fitted world; empty if there is no fit, or if a property of it was deleted or edited."""
    return stored.text(scene, _FINGERPRINT) if _is_whole(scene) else ""


def _is_whole(scene: bpy.types.Scene) -> bool:
    """Whether the properties of all sources are complete."""
    noted = [[source_name(index, what) in scene for what in _ALWAYS] for index in range(SOURCES_MAX)]
    names = [source_name(index, what) for index in range(sum(map(any, noted))) for what in _ALWAYS]
    return all(stored.numbers(scene, name, 4) is not None for name in names)


def missed_share(scene: bpy.types.Scene) -> float:
    """The share of the world's light that is bright and compact but in no source."""
    return stored.number(scene, _MISSED, low=0.0, high=1.0)


def source_name(index: int, what: str) -> str:
    """The name of a source's property."""
    return f"{_PREFIX}{index}_{what}"


_SKY_SUN_NAME = "Sky Sun"
# Custom property of the lamp, saved in files: marks what the next such lamp replaces.
_SKY_SUN = "ng_sky_sun"
_WITHOUT_SUN = ("PREETHAM", "HOSEK_WILKIE")


def sky_with_disc(world: bpy.types.World | None) -> bpy.types.ShaderNodeTexSky | None:
    """The first Sky Texture among the world's own nodes that is in use and shows its sun disc; else None."""
    tree = None if world is None else compat.world_nodes(world)
    skies = [node for node in (tree.nodes if tree else ()) if isinstance(node, bpy.types.ShaderNodeTexSky)]
    shown = (sky for sky in skies if sky.sun_disc and sky.sky_type not in _WITHOUT_SUN)
    return next((sky for sky in shown if any(output.is_linked for output in sky.outputs)), None)


def add_sky_sun(scene: bpy.types.Scene, sky: bpy.types.ShaderNodeTexSky, source: Source) -> bpy.types.Object:
    """Replace the disc of the scene's sky by a sun lamp with the light of the source that was fitted to it. Returns the
    lamp. It is a copy: Blender evaluates no driver anew that reads a node of a world."""
    for former in [thing for thing in scene.collection.all_objects if stored.flag(thing, _SKY_SUN)]:
        bpy.data.batch_remove([former.data, former])
    data = bpy.data.lights.new(_SKY_SUN_NAME, "SUN")
    data.energy = max(float(source.irradiance.max()), 0.0)
    data.color = np.clip(source.irradiance / max(data.energy, 1e-30), 0, 1).tolist()
    # The disc of even brightness that has the source's variance (lamp_drivers.py).
    data.angle = 2 * math.asin(min(2 * math.sqrt(source.variance), 1.0))
    sun = bpy.data.objects.new(_SKY_SUN_NAME, data)
    sun[_SKY_SUN] = True
    scene.collection.objects.link(sun)
    sun.rotation_euler = Vector(source.direction.tolist()).to_track_quat("Z", "Y").to_euler()
    sky.sun_disc = False
    return sun


# Instead of the axes of a lamp, and of the cosines of a spot (lamp_drivers.py).
_NO_AXES: tuple[Operand, ...] = ((0.0, 0.0, 0.0), -3.0, (0.0, 0.0, 0.0), -2.0)


def source_light(tree: Tree, index: int, *, coloured: bool = False) -> tuple[Light, list[Operand]]:
    """Add nodes that read the world's source `index`; and return it packed as a sun too (lamp_drivers.py). All values
    are 0 if it does not exist. `coloured`: it may be of another spectrum than white."""
    (direction, disc), (irradiance, shadow) = (
        read_property(tree, source_name(index, what)) for what in ("place", "power")
    )
    row = read_number(tree, source_name(index, SPECTRUM)) if coloured else None
    light = Light(direction, irradiance, tree.maximum(-1.0 - disc, 0.0), FAR, shadow, spectrum=row)
    return light, [direction, disc, irradiance, shadow, *_NO_AXES]
