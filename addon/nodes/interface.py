# SPDX-License-Identifier: GPL-3.0-or-later
"""The sockets of a node group."""

from __future__ import annotations

from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class Socket:
    """An input or output of a group: its kind (Float, Vector, Color, Shader), default, range and tooltip."""

    name: str
    kind: str
    text: str
    default: float | None = None
    low: float | None = None
    high: float | None = None
    subtype: str | None = None


def add_interface(group: bpy.types.NodeTree, inputs: tuple[Socket, ...], outputs: tuple[Socket, ...]) -> None:
    """Give a new group its sockets. Vectors without a default hide their value: they are for links."""
    for in_out, sockets in (("INPUT", inputs), ("OUTPUT", outputs)):
        for socket in sockets:
            made = group.interface.new_socket(
                socket.name, in_out=in_out, socket_type=f"NodeSocket{socket.kind}", description=socket.text
            )
            if in_out == "OUTPUT" or socket.kind == "Shader":
                continue
            if socket.default is None:
                made.hide_value = True
                continue
            if socket.subtype:
                made.subtype = socket.subtype
            made.default_value = socket.default
            if socket.low is not None:
                made.min_value, made.max_value = socket.low, socket.high
