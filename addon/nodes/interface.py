# SPDX-License-Identifier: GPL-3.0-or-later
"""The sockets, order and completeness of a node group, and its size: nodes, look-ups, and the bytes of constants
in EEVEE.

An artist may delete nodes and links, so a group stores how many it was made with."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from graphlib import TopologicalSorter
from typing import Any, NamedTuple

import bpy

from ..blender import compat, stored


class Socket(NamedTuple):
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


# Widths of a group's node, which leave the inputs' names whole, and of a column: a Principled node is 240 wide.
GROUP_WIDTH, _COLUMN = 200, 280


def arrange(tree: bpy.types.NodeTree) -> None:
    """Place each node in a column to the right of all nodes that feed it.

    Nodes must have been created in the order of the formula: inputs before their users."""
    feeding: dict[bpy.types.Node, list[bpy.types.Node]] = {}
    for link in tree.links:  # socket.links would search all links for each socket
        feeding.setdefault(link.to_node, []).append(link.from_node)
    depth: dict[bpy.types.Node, int] = {}
    for node in tree.nodes:
        depth[node] = 1 + max((depth.get(before, 0) for before in feeding.get(node, ())), default=-1)
    filled: dict[int, int] = {}
    places: list[int] = []
    for column in depth.values():
        row = filled.get(column, 0)
        filled[column] = row + 1
        places += (column * _COLUMN, -row * 220)
    tree.nodes.foreach_set("location", places)  # one by one, Blender would update the tree for each


# Custom property of a node group, saved in files: the numbers of nodes and links.
_PARTS = "ng_parts"


def note_parts(tree: bpy.types.NodeTree) -> None:
    """Store the numbers of a node group's nodes and links."""
    tree[_PARTS] = f"{len(tree.nodes)} {len(tree.links)}"


def has_parts(tree: bpy.types.NodeTree) -> bool:
    """Whether a node group has at least the stored numbers of nodes and links; true if an older file stores none."""
    nodes, _, links = stored.text(tree, _PARTS).partition(" ")
    if not (nodes.isdecimal() and links.isdecimal() and len(nodes + links) < 20):
        return True
    return len(tree.nodes) >= int(nodes) and len(tree.links) >= int(links)


# What is said of a node group that holds a deleted one.
DELETED = "a node group in it was deleted"


def lost_in(tree: bpy.types.NodeTree) -> str:
    """What a node group or a group within it has lost of its nodes and links, in a few words, or empty."""
    if not has_parts(tree):
        return f"nodes or links were deleted in {tree.name}"
    inner = {node.node_tree for node in tree.nodes if node.type == "GROUP"}
    return DELETED if None in inner else next(filter(None, map(lost_in, inner)), "")


# EEVEE has this many bytes for the constants of a material, and draws a larger one in magenta. It flattens all groups.
# It stores a constant for each unlinked input socket, even if the node's operation does not use the socket. A colour
# takes 16 bytes, a vector 12 plus a gap of 4 that a number may fill, and a number 4. Nodes that do not lead to an
# output of the material take nothing. Blender 5.2 also computes what depends on constants alone, and stores of a Mix
# node only the sockets of the node's data type.
ROOM = 65536
_OUTPUTS = {"GROUP_OUTPUT", "OUTPUT_MATERIAL", "OUTPUT_AOV"}
_KINDS = {"VALUE": "VALUE", "INT": "VALUE", "BOOLEAN": "VALUE", "VECTOR": "VECTOR", "RGBA": "RGBA"}
_NO_NODES = {"GROUP", "GROUP_INPUT", "REROUTE"}
# Numbers that a node holds besides its sockets: EEVEE mixes shaders by Math nodes; Texture Coordinate has a matrix.
_BESIDES = {"MIX_SHADER": 6, "ADD_SHADER": 2, "TEX_COORD": 16, "VALUE": 1, "RGB": 4}

# Nodes that Blender 5.2 evaluates if all of their inputs are constants.
_EVALUATED = {"MATH", "VECT_MATH", "MIX", "COMBXYZ", "SEPXYZ"} if compat.EEVEE_EVALUATES_CONSTANTS else set()


# The nodes at which a loop begins and ends.
LOOP, LOOP_END = "GeometryNodeRepeatInput", "GeometryNodeRepeatOutput"


class Size(NamedTuple):
    """What a material's node tree, or a material that contains only this group, costs: its nodes, how often a sample
    looks up pictures, and in EEVEE the bytes of its constants."""

    nodes: int
    look_ups: int
    constant_bytes: int


def size_of(tree: bpy.types.NodeTree) -> Size:
    """The size of a node tree, counted in all of its groups. What leads to no output does not count."""
    found = _counted(tree, None, None, {})
    constants = 16 * (found["RGBA"] + found["VECTOR"]) + 4 * max(0, found["VALUE"] - found["VECTOR"])
    return Size(found["NODE"], found["LOOK_UP"], constants)


def _counted(
    tree: bpy.types.NodeTree, asked: frozenset[str] | None, fixed: frozenset[str] | None, known: dict[Any, Counter[str]]
) -> Counter[str]:
    """The nodes and look-ups of a tree, and its constants by kind. `asked`: identifiers of the group's linked outputs.
    `fixed`: identifiers of its inputs that are constants. None stands for all. `known` caches earlier counts."""
    if (found := known.get((tree, asked, fixed))) is not None:
        return found
    found = known[tree, asked, fixed] = Counter()
    sources = {link.to_socket: link.from_socket for link in tree.links if not link.is_muted}
    ordered = list(_in_order(tree, sources))
    constant, turns = _constant_outputs(ordered, sources, fixed), _turns(ordered, sources)
    outputs = defaultdict(set)  # the linked outputs of each node
    ends = [socket for node in tree.nodes if node.type in _OUTPUTS for socket in node.inputs]
    waiting = [s for s in ends if asked is None or s.node.type != "GROUP_OUTPUT" or s.identifier in asked]
    while waiting:
        socket = waiting.pop()
        if (source := sources.get(socket)) is None or source in constant:
            node = socket.node
            stored = node.type != "GROUP" and (node.type != "MIX" or socket.enabled or not _EVALUATED)
            if stored and not socket.hide_value and socket.type in _KINDS:
                found[_KINDS[socket.type]] += 1
            continue
        if source.node not in outputs:
            waiting += source.node.inputs
            found["VALUE"] += _BESIDES.get(source.node.type, 0)
        outputs[source.node].add(source.identifier)
    for node, linked in outputs.items():
        if node.type == "GROUP" and node.node_tree is not None:
            given = frozenset(s.identifier for s in node.inputs if s not in sources or sources[s] in constant)
            within = _counted(node.node_tree, frozenset(linked), given, known)
            found.update(within)
            found["LOOK_UP"] += within["LOOK_UP"] * (turns.get(node, 1) - 1)
        elif node.type not in _NO_NODES:
            found["NODE"] += 1
            found["LOOK_UP"] += turns.get(node, 1) if node.type == "TEX_IMAGE" else 0
    return found


def _turns(
    ordered: list[bpy.types.Node], sources: dict[bpy.types.NodeSocket, bpy.types.NodeSocket]
) -> dict[bpy.types.Node, int]:
    """For each node in a loop, how often a sample computes it. `ordered`: the tree's nodes by _in_order."""
    found: dict[bpy.types.Node, int] = {}
    if any(node.bl_idname == LOOP for node in ordered):
        for node in ordered:
            read = [sources[socket].node for socket in node.inputs if socket in sources]
            if node.bl_idname == LOOP:
                found[node] = node.inputs[0].default_value
            elif node.bl_idname != LOOP_END and (within := [found[each] for each in read if each in found]):
                found[node] = within[0]
    return found


def _constant_outputs(
    ordered: list[bpy.types.Node],
    sources: dict[bpy.types.NodeSocket, bpy.types.NodeSocket],
    fixed: frozenset[str] | None,
) -> set[bpy.types.NodeSocket]:
    """The outputs of a tree's nodes that EEVEE replaces by constants. `ordered`: the nodes by _in_order. `sources`: the
    output that each linked input reads. `fixed` as in _counted."""
    found: set[bpy.types.NodeSocket] = set()
    for node in ordered:
        if node.type == "GROUP_INPUT":
            found.update(socket for socket in node.outputs if fixed is None or socket.identifier in fixed)
        elif node.type in _EVALUATED and all(s not in sources or sources[s] in found for s in node.inputs):
            found.update(node.outputs)
    return found


def _in_order(
    tree: bpy.types.NodeTree, sources: dict[bpy.types.NodeSocket, bpy.types.NodeSocket]
) -> Iterable[bpy.types.Node]:
    """A tree's nodes, each after all that it reads. Trees of the builder have this order, and sorting takes longer
    than the rest of the count."""
    place = {node: index for index, node in enumerate(tree.nodes)}
    pairs = [(given.node, source.node) for given, source in sources.items()]
    if all(place[source] < place[node] for node, source in pairs):
        return tree.nodes
    order = TopologicalSorter(dict.fromkeys(tree.nodes, ()))
    for node, source in pairs:
        order.add(node, source)
    return order.static_order()
