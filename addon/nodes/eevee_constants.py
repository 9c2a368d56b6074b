# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts the bytes that a material's constants take in EEVEE. It has 64 KiB for them, and draws a larger material in
magenta.

EEVEE flattens all groups. It stores a constant for each unlinked input socket, even if the node's operation does not
use the socket. A colour takes 16 bytes, a vector 12 plus a gap of 4 that a number may fill, and a number 4. Nodes that
do not lead to an output of the material take nothing. Blender 5.2 also computes what depends on constants alone, and
stores of a Mix node only the sockets of the node's data type."""

from collections import Counter, defaultdict
from graphlib import TopologicalSorter
from typing import Any

import bpy

from ..blender import compat

ROOM = 65536
_OUTPUTS = {"GROUP_OUTPUT", "OUTPUT_MATERIAL", "OUTPUT_AOV"}
_KINDS = {"VALUE": "VALUE", "INT": "VALUE", "BOOLEAN": "VALUE", "VECTOR": "VECTOR", "RGBA": "RGBA"}
# Numbers that a node holds besides its sockets: EEVEE mixes shaders by Math nodes; Texture Coordinate has a matrix.
_BESIDES = {"MIX_SHADER": 6, "ADD_SHADER": 2, "TEX_COORD": 16, "VALUE": 1, "RGB": 4}

# Nodes that Blender 5.2 evaluates if all of their inputs are constants.
_EVALUATED = {"MATH", "VECT_MATH", "MIX", "COMBXYZ", "SEPXYZ"} if compat.EEVEE_EVALUATES_CONSTANTS else set()


def constant_bytes(tree: bpy.types.NodeTree) -> int:
    """The bytes of constants of a material's node tree, or of a material that contains only this group."""
    found = _constants(tree, None, None, {})
    return 16 * (found["RGBA"] + found["VECTOR"]) + 4 * max(0, found["VALUE"] - found["VECTOR"])


def _constants(
    tree: bpy.types.NodeTree, asked: frozenset[str] | None, fixed: frozenset[str] | None, known: dict[Any, Counter[str]]
) -> Counter[str]:
    """The constants of a tree, counted by kind. `asked`: identifiers of the group's linked outputs. `fixed`:
    identifiers of its inputs that are constants. None stands for all. `known` caches earlier counts."""
    if (found := known.get((tree, asked, fixed))) is not None:
        return found
    found = known[tree, asked, fixed] = Counter()
    sources, constant = _sources(tree), _constant_outputs(tree, fixed)
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
            found.update(_constants(node.node_tree, frozenset(linked), given, known))
    return found


def _constant_outputs(tree: bpy.types.NodeTree, fixed: frozenset[str] | None) -> set[bpy.types.NodeSocket]:
    """The outputs of a tree's nodes that EEVEE replaces by constants. `fixed` as in `_constants`."""
    found: set[bpy.types.NodeSocket] = set()
    sources = _sources(tree)
    order = TopologicalSorter(dict.fromkeys(tree.nodes, ()))
    for given, source in sources.items():
        order.add(given.node, source.node)
    for node in order.static_order():
        if node.type == "GROUP_INPUT":
            found.update(socket for socket in node.outputs if fixed is None or socket.identifier in fixed)
        elif node.type in _EVALUATED and all(s not in sources or sources[s] in found for s in node.inputs):
            found.update(node.outputs)
    return found


def _sources(tree: bpy.types.NodeTree) -> dict[bpy.types.NodeSocket, bpy.types.NodeSocket]:
    """The output that each linked input of a tree's nodes reads."""
    return {link.to_socket: link.from_socket for link in tree.links if not link.is_muted}
