# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups that a file has once, for all of its materials.

Blender takes time in proportion to the square of a group's nodes to make them. So what each lamp needs is a group of
its own, and so is a formula of many nodes."""

from collections.abc import Callable, Mapping

import bpy

from ..blender import stored
from .builder import Operand, Tree, Value
from .interface import Socket, add_interface, arrange, has_sockets, lost_in, note_parts

# Custom property that marks a shared group by its name, saved in files.
SHARED = "ng_shared"


def shared_group(
    name: str, inputs: tuple[Socket, ...], outputs: tuple[Socket, ...], *, build: Callable[[Tree], None], of: str = ""
) -> bpy.types.NodeTree:
    """The file's group of a name, created if needed. `build` adds its nodes. `of` tells apart groups of one name whose
    nodes hold other constants."""
    mark = f"{name} {of}".strip()
    for group in bpy.data.node_groups:
        is_one = stored.text(group, SHARED) == mark and group.library is None
        if is_one and has_sockets(group, inputs, outputs) and not lost_in(group):
            return group
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    group[SHARED] = mark
    add_interface(group, inputs, outputs)
    build(Tree(group))
    arrange(group)
    note_parts(group)
    return group


def by_group(
    tree: Tree, name: str, formula: Callable[..., tuple[Value, ...]], given: Mapping[str, Operand],
    gives: Mapping[str, str], *, of: str = "",
) -> tuple[Value, ...]:  # fmt: skip
    """Add a node of the file's group of a formula. The formula gets a Tree and the values of `given`, and returns the
    values `gives`, each of a kind of socket. `of` has the constants in it, if they may differ."""
    vectors = {name for name, value in given.items() if isinstance(value, Value) and value.is_vector}
    inputs = tuple(Socket(name, "Vector" if name in vectors else "Float", "") for name in given)
    outputs = tuple(Socket(each, kind, "") for each, kind in gives.items())

    def build(inner: Tree) -> None:
        inner.output(*formula(inner, *inner.inputs().values()))

    found = tree.group(shared_group(name, inputs, outputs, build=build, of=of), given)
    return tuple(found[each] for each in gives)
