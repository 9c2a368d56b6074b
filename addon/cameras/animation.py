# SPDX-License-Identifier: GPL-3.0-or-later
"""Finding out which parts of a scene may change from frame to frame."""

from collections.abc import Iterable, Iterator
from typing import Any

import bpy

# Modifiers that can move a mesh without keyframes.
_BY_THEMSELVES = {
    "CLOTH", "SOFT_BODY", "FLUID", "DYNAMIC_PAINT", "OCEAN", "WAVE", "MESH_SEQUENCE_CACHE", "MESH_CACHE", "NODES",
    "PARTICLE_SYSTEM", "EXPLODE", "BUILD",
}  # fmt: skip


def moves(things: Iterable[bpy.types.Object]) -> bool:
    """Whether one of the objects, or an object that it depends on, may change from frame to frame."""
    pending, seen = list(things), set()
    while pending:
        thing = pending.pop()
        if thing in seen:
            continue
        seen.add(thing)
        if any(map(is_animated, _blocks(thing))) or any(m.type in _BY_THEMSELVES for m in thing.modifiers):
            return True
        pending += _leads_to(thing)
    return False


def frames_between(first: int, last: int, most: int) -> list[int]:
    """At most `most` evenly spaced frames, including `first` and `last`."""
    count = min(most, last - first + 1)
    return sorted({first + round(k * (last - first) / max(count - 1, 1)) for k in range(count)})


def _blocks(thing: bpy.types.Object) -> Iterator[bpy.types.ID]:
    yield thing
    if thing.data is not None:
        yield thing.data
        if getattr(thing.data, "shape_keys", None) is not None:
            yield thing.data.shape_keys


def is_animated(block: Any) -> bool:
    """Whether keyframes, NLA strips or drivers change a data-block."""
    held = block.animation_data
    return held is not None and bool(held.action or held.nla_tracks or held.drivers)


def _leads_to(thing: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """The objects that the object's parent, constraints and modifiers point to."""
    held = [thing, *thing.constraints, *thing.modifiers]
    if thing.pose is not None:
        held += [constraint for bone in thing.pose.bones for constraint in bone.constraints]
    for one in held:
        named = [
            own for own in one.bl_rna.properties if own.type == "POINTER" and own.fixed_type.identifier == "Object"
        ]
        yield from filter(None, (getattr(one, own.identifier) for own in named))
