# SPDX-License-Identifier: GPL-3.0-or-later
"""The sockets of a node group."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy


@dataclass(frozen=True)
class Socket:
    """An input or output of a group.

    kind        Float, Vector, Color or Shader
    text        tooltip
    default     of an input; None for an input that is only for links
    low, high   range of an input, if limited
    subtype     display of the value, such as FACTOR or ANGLE"""

    name: str
    kind: str
    text: str
    default: float | None = None
    low: float | None = None
    high: float | None = None
    subtype: str | None = None


INPUT, OUTPUT = "INPUT", "OUTPUT"


def add_interface(group: bpy.types.NodeTree, inputs: tuple[Socket, ...], outputs: tuple[Socket, ...]) -> None:
    """Add sockets to a new group. An input without a default hides its value."""
    for in_out, sockets in ((INPUT, inputs), (OUTPUT, outputs)):
        for socket in sockets:
            _add(group, in_out, socket)


def sockets_of(group: bpy.types.NodeTree, in_out: str) -> list[Any]:
    """The inputs or outputs of a group, in their order."""
    items = group.interface.items_tree
    return [item for item in items if item.item_type == "SOCKET" and item.in_out == in_out]


def has_sockets(group: bpy.types.NodeTree, inputs: Sequence[Socket], outputs: Sequence[Socket]) -> bool:
    """Whether a group has at least these inputs, and exactly these outputs in this order."""
    items = [item for item in group.interface.items_tree if item.item_type == "SOCKET"]  # read once: slow
    present = [(item.in_out, item.name, item.socket_type) for item in items]
    names = [name for in_out, name, _ in present if in_out == INPUT]
    are_in = all((INPUT, socket.name, _kind(socket)) in present and names.count(socket.name) == 1 for socket in inputs)
    given = [each for each in present if each[0] == OUTPUT]
    return are_in and given == [(OUTPUT, socket.name, _kind(socket)) for socket in outputs]


def restore_interface(group: bpy.types.NodeTree, inputs: tuple[Socket, ...], outputs: tuple[Socket, ...]) -> None:
    """Restore sockets that an artist deleted, renamed or changed to another type. Renamed sockets in their original
    place, and all intact ones, keep their links. Unknown outputs are removed."""
    if has_sockets(group, inputs, outputs):
        return
    for in_out, wanted in ((INPUT, inputs), (OUTPUT, outputs)):
        names = {socket.name for socket in wanted}
        for socket, item in zip(wanted, sockets_of(group, in_out), strict=False):
            if item.name not in names and all(each.name != socket.name for each in sockets_of(group, in_out)):
                item.name = socket.name
        kept: dict[str, Any] = {}
        for item in sockets_of(group, in_out):
            if item.name in kept or (in_out == OUTPUT and item.name not in names):
                group.interface.remove(item)
            else:
                kept[item.name] = item
        for socket in wanted:
            item = kept.get(socket.name)
            if item is not None and item.socket_type != _kind(socket):
                group.interface.remove(item)
                item = None
            item = item or _add(group, in_out, socket)
            # Moving each to the end restores the order.
            group.interface.move(item, len(group.interface.items_tree))


def _kind(socket: Socket) -> str:
    return f"NodeSocket{socket.kind}"


def _add(group: bpy.types.NodeTree, in_out: str, socket: Socket) -> Any:
    made: Any = group.interface.new_socket(
        socket.name,
        in_out=in_out,  # type: ignore[arg-type]  # INPUT or OUTPUT
        socket_type=_kind(socket),
        description=socket.text,
    )
    if in_out == OUTPUT or socket.kind == "Shader":
        return made
    if socket.default is None:
        made.hide_value = True
        return made
    if socket.subtype:
        made.subtype = socket.subtype
    made.default_value = socket.default
    if socket.low is not None:
        made.min_value, made.max_value = socket.low, socket.high
    return made
