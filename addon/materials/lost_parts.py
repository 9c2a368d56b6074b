# SPDX-License-Identifier: GPL-3.0-or-later
"""Missing parts of Diffraction groups (data-blocks that an artist deleted, exchanged or edited), and replacing a
group's own response, after a new bake too."""

from collections.abc import Iterable

import bpy

from ...precompute.base.failure import GratingError
from ..gratings.direction_source import is_frame_map
from ..nodes.interface import DELETED
from .group_properties import diffraction_groups, is_diffraction, variation_of
from .pictures import fault_in, parts_of, remove_unused
from .response import Response, further_responses, is_response, own_trees, response_in, trees_at
from .skin import is_outdated, is_whole, refill

_OUTDATED = "another version of Blender saved its nodes"


def lost_of_own(group: bpy.types.NodeTree) -> str:
    """What is missing in a Diffraction group's own response, or empty. A new response repairs it."""
    shown = trees_at(group)
    own = [tree for number, tree in shown if number == 1]
    sound = [tree for tree in own if tree is not None]
    return DELETED if own_trees(group)[0] is None or len(sound) < len(own) else _fault_of(sound)


def lost_of_others(group: bpy.types.NodeTree) -> str:
    """What is missing in the further responses of a Diffraction group's variation, or empty."""
    others = [tree for number, tree in trees_at(group) if number > 1]
    sound = [tree for tree in others if tree is not None]
    is_missing = len(sound) < len(others) or len(further_responses(group)) < len(variation_of(group).shares)
    return DELETED if is_missing else _fault_of(sound)


def lost_of_nodes(group: bpy.types.NodeTree) -> str:
    """What else is missing in a Diffraction group, or empty. Refilling the group repairs it."""
    if is_outdated(group):
        return _OUTDATED
    if not is_whole(group):
        return "nodes, links or sockets of it were deleted"
    for node in group.nodes:
        if node.type == "GROUP" and not is_response(node):
            if node.node_tree is None:
                return DELETED
            if fault := fault_in(node.node_tree):
                return fault
        if node.type == "TEX_IMAGE" and not is_frame_map(node.image):
            return "its direction map was deleted"
        if node.type == "SCRIPT" and node.mode == "INTERNAL" and node.script is None:
            return "its script was deleted"
    return ""


def lost(groups: Iterable[bpy.types.NodeTree]) -> list[str]:
    """One warning line for each Diffraction group with missing parts, with the remedy."""
    return [str(fault) for fault in faults_of(groups)]


def faults_of(groups: Iterable[bpy.types.NodeTree]) -> list[GratingError]:
    """One error for each Diffraction group with missing parts."""
    faults = []
    for group in filter(is_diffraction, groups):
        own, others = lost_of_own(group) or lost_of_nodes(group), lost_of_others(group)
        if own or others:
            remedy = "press Mend Materials" if own or others != DELETED else "choose its Variation again"
            if group.library is not None:
                # Repairing it in its own file would restore the shadows of that other Blender version.
                file = group.library.filepath
                remedy = f"make it local, as {file} cannot be changed" if own == _OUTDATED else f"mend it in {file}"
            faults.append(GratingError(group.name, own or others, remedy))
    return faults


def _fault_of(trees: Iterable[bpy.types.NodeTree]) -> str:
    return next(filter(None, map(fault_in, trees)), "")


def replace_response(group: bpy.types.NodeTree, response: Response) -> None:
    """Rebuild a Diffraction group around another response, and all groups whose variation uses the old one. Names stay
    the same. The old response and its images, which may be incomplete, are removed unless something else uses them."""
    old_group, old_world = own_trees(group)
    names = _names_to_keep(response, (old_group, old_world))
    left = [part for each in (old_group, old_world) for part in parts_of(each)]
    for each in diffraction_groups():
        own = (response if each == group else response_in(each),)
        further = further_responses(each)
        if each.library is None and None not in own and (each == group or _is_among(old_group, further)):
            refill(each, (*own, *(response if one.group == old_group else one for one in further)))
    if old_group is not None:
        old_group.user_remap(response.group)  # for Diffraction Lamps
    remove_unused(left)
    for kept, name in names:
        kept.name = name


def _is_among(tree: bpy.types.NodeTree | None, responses: Iterable[Response]) -> bool:
    return tree is not None and any(response.group == tree for response in responses)


def _names_to_keep(
    response: Response, old: tuple[bpy.types.NodeTree | None, bpy.types.NodeTree | None]
) -> list[tuple[bpy.types.ID, str]]:
    """The data-blocks of a new response, with the old names that they take over. Excludes images used elsewhere."""
    found = {}
    for new_tree, old_tree in zip((response.group, response.world), old, strict=True):
        if new_tree is None or old_tree is None:
            continue
        found[new_tree] = old_tree.name
        former = {node.label: node.image for node in _picture_nodes(old_tree)}
        for node in _picture_nodes(new_tree):
            if former.get(node.label) is not None and node.image.users == _uses(response, node.image):
                found[node.image] = former[node.label].name
    return list(found.items())


def _uses(response: Response, image: bpy.types.Image) -> int:
    """The number of a response's nodes that read an image."""
    trees = filter(None, (response.group, response.world))
    return sum(node.image == image for tree in trees for node in _picture_nodes(tree))


def _picture_nodes(tree: bpy.types.NodeTree) -> list[bpy.types.Node]:
    return [node for node in tree.nodes if node.type == "TEX_IMAGE"]
