# SPDX-License-Identifier: GPL-3.0-or-later
"""The sockets of a node group."""

from __future__ import annotations

from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class Socket:
    """An input or output of a group.

    kind        Float, Vector, Color or Shader
    text        the tooltip
    default     of an input; None for an input that is only for links
    low, high   the range of an input, if it has one
    subtype     how Blender shows the value, such as FACTOR or ANGLE
    """

    name: str
    kind: str
    text: str
    default: float | None = None
    low: float | None = None
    high: float | None = None
    subtype: str | None = None


def add_interface(group: bpy.types.NodeTree, inputs: tuple[Socket, ...], outputs: tuple[Socket, ...]) -> None:
    """Give a new group its sockets. An input without a default hides its value."""
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
