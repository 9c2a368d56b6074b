# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a world's light may change from frame to frame.

Sources hold the light of one frame and would be wrong in others, so an animated world has no sources."""

import bpy

from ..blender import compat

# The properties that this add-on's drivers write on a scene. Drivers of a world may read other properties of the scene.
_FOLLOWED_LAMP = '["ng_'
_MOVING_PICTURES = {"MOVIE", "SEQUENCE"}


def is_animated(world: bpy.types.World, blocks: set[bpy.types.ID] | None = None) -> bool:
    """Whether the world, its nodes, or what they refer to (node groups, objects and what the objects follow) is
    animated: by keyframes or strips, a driver that reads the frame or something animated, or a movie or image sequence.

    Adds the data-blocks that the answer depends on to `blocks`."""
    return _changes(world, set() if blocks is None else blocks)


def _changes(holder: bpy.types.ID | None, seen: set[bpy.types.ID]) -> bool:
    if holder is None or holder in seen:
        return False
    seen.add(holder)
    animation = holder.animation_data if hasattr(holder, "animation_data") else None
    if animation is not None and (_has_keys(animation) or _is_driven(animation, seen)):
        return True
    return any(_changes(other, seen) for other in _refers_to(holder)) or _shows_frames(holder)


def _has_keys(animation: bpy.types.AnimData) -> bool:
    """Whether there are strips or varying keyframes. A single keyframe is constant, unless its curve has a modifier."""
    if any(track.strips for track in animation.nla_tracks):
        return True
    if animation.action is None:
        return False
    start, end = animation.action.curve_frame_range
    bags = [bag for layer in animation.action.layers for strip in layer.strips for bag in strip.channelbags]
    return end > start or any(curve.modifiers for bag in bags for curve in bag.fcurves)


def _is_driven(animation: bpy.types.AnimData, seen: set[bpy.types.ID]) -> bool:
    for curve in animation.drivers:
        if curve.data_path.startswith(_FOLLOWED_LAMP):
            continue
        driver = curve.driver
        if driver.type == "SCRIPTED" and "frame" in driver.expression:
            return True
        for variable in driver.variables:
            for target in variable.targets:
                if "frame" in target.data_path or _changes(target.id, seen):
                    return True
    return False


def _refers_to(holder: bpy.types.ID) -> list[bpy.types.ID | None]:
    if isinstance(holder, bpy.types.World):
        return [compat.world_nodes(holder)]
    if isinstance(holder, bpy.types.NodeTree):
        found = [getattr(node, name, None) for node in holder.nodes for name in ("node_tree", "object", "image")]
        return [each for each in found if isinstance(each, bpy.types.ID)]
    if isinstance(holder, bpy.types.Object):
        return [holder.parent, holder.data, *(getattr(each, "target", None) for each in holder.constraints)]
    return []


def _shows_frames(holder: bpy.types.ID) -> bool:
    return isinstance(holder, bpy.types.Image) and holder.source in _MOVING_PICTURES
