# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a world changes: from frame to frame, and by a fingerprint of its nodes, without a render.

Sources hold the light of one frame and would be wrong in others, so an animated world has none."""

import hashlib
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..blender import compat
from ..blender.guard import absolute
from ..blender.working_space import working_space

# Properties of all nodes, such as their place in the editor; of these, only muting changes the light.
_OF_ALL_NODES = {own.identifier for own in bpy.types.Node.bl_rna.properties} - {"mute"}
# The current frame of an image user, ignored because it advances for still pictures too.
_FRAME = "frame_current"
# The blocks of a picture's file that are read, and their size in bytes.
_BLOCKS, _BLOCK = 64, 4096
_PLAIN = {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}


def fingerprint(world: bpy.types.World, blocks: set[bpy.types.ID] | None = None) -> str:
    """The fingerprint of the world's nodes at the current frame: links, values, pictures (name, file name, content),
    mappings, curves, ramps, and the positions of referenced objects.

    Of a picture in a file of its own it reads samples, so it may miss a small change that another program makes there
    without a change of the file's size. It does not detect the frames of a movie. Adds the data-blocks that the
    fingerprint depends on to `blocks`."""
    seen = set() if blocks is None else blocks
    seen.add(world)
    facts = [working_space(), tuple(world.color), world.cycles_visibility.glossy]
    facts += _tree_facts(compat.world_nodes(world), seen)
    return hashlib.sha256(repr(facts).encode()).hexdigest()


def _tree_facts(tree: bpy.types.NodeTree | None, seen: set[bpy.types.ID]) -> Iterator[object]:
    if tree is None or tree in seen:
        return
    seen.add(tree)
    for node in sorted(tree.nodes, key=lambda node: node.name):
        yield node.name, node.bl_idname
        for own in node.bl_rna.properties:
            if own.identifier not in _OF_ALL_NODES:
                yield own.identifier, list(_facts(node, own, seen))
        for socket in (*node.inputs, *node.outputs):
            value: Any = getattr(socket, "default_value", None)
            yield tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
    for link in tree.links:
        yield link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier


def _file_facts(image: bpy.types.Image) -> tuple[str, int, int]:
    """The name of a picture's file, its size in bytes, and a checksum. Its folder differs between machines, so it is
    ignored."""
    name = bpy.path.basename(image.filepath)
    if image.packed_file is not None:
        return name, image.packed_file.size, zlib.crc32(image.packed_file.data)
    path = Path(absolute(image.filepath, image.library))
    if not (image.filepath and path.is_file()):
        return name, 0, 0
    return name, path.stat().st_size, _sampled(path)


def _sampled(path: Path) -> int:
    """A checksum of blocks that are spread evenly over a file, with its last one. 0 for a file that cannot be read."""
    checksum = 0
    try:
        with path.open("rb") as file:
            last = max(path.stat().st_size - _BLOCK, 0)
            for number in range(_BLOCKS):
                file.seek(last * number // (_BLOCKS - 1))
                checksum = zlib.crc32(file.read(_BLOCK), checksum)
    except OSError:
        return 0
    return checksum


def _pixels(image: bpy.types.Image) -> int:
    """A checksum of a picture's pixels in memory."""
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return zlib.crc32(values.data)  # no copy: a panorama has a hundred megabytes, and each stroke comes here


def _facts(owner: bpy.types.bpy_struct, own: bpy.types.Property, seen: set[bpy.types.ID]) -> Iterator[object]:
    """The values of one property and of everything in it. Adds the data-blocks on the way to `seen`."""
    if own.identifier in ("rna_type", _FRAME):
        return
    value = getattr(owner, own.identifier)
    if isinstance(value, bpy.types.ID) and not isinstance(value, bpy.types.NodeTree):
        seen.add(value)
    if own.type in _PLAIN:
        yield tuple(value) if getattr(own, "is_array", False) else value
    elif isinstance(value, bpy.types.Image):
        yield value.name_full, *_file_facts(value)
        if value.source == "GENERATED" or value.is_dirty:  # for other pictures, Blender would load the whole file
            yield tuple(value.size), _pixels(value)
        yield value.is_dirty, value.source, value.colorspace_settings.name, value.alpha_mode
    elif isinstance(value, bpy.types.NodeTree):
        yield value.name_full, list(_tree_facts(value, seen))
    elif isinstance(value, bpy.types.Object):
        yield value.name_full, [tuple(row) for row in value.matrix_world]
    elif isinstance(value, bpy.types.Text):
        yield value.as_string()
    elif isinstance(value, bpy.types.ID):
        yield value.name_full
    elif value is not None:
        for part in value if own.type == "COLLECTION" else (value,):
            for inner in part.bl_rna.properties:
                yield inner.identifier, list(_facts(part, inner, seen))


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
