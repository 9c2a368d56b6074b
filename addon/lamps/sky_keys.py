# SPDX-License-Identifier: GPL-3.0-or-later
"""Keyframes on the properties that hold a world's sources (sky.py).

Each value is constant until the next key, so a frame never shows a mixture of the sources of two others."""

from collections.abc import Iterator, Sequence

import bpy

_CONSTANT = 0  # the interpolation's number in Blender
_PREFIX = '["ng_world_'


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
    found = [(bag, curve) for bag, curve in _curves(scene) if curve.data_path.startswith(_PREFIX)]
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
