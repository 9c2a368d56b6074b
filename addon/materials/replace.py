# SPDX-License-Identifier: GPL-3.0-or-later
"""Replacing a Diffraction group's own response, after a new bake or after an artist deleted parts of it."""

from collections.abc import Iterable

import bpy

from ..blender import compat
from .group_properties import is_diffraction
from .response import Response, further_responses, own_trees, response_in
from .skin import refill


def replace_response(group: bpy.types.NodeTree, response: Response) -> None:
    """Rebuild a Diffraction group around another response, and all groups whose variation uses the old one. Names stay
    the same. The old response and its images, which may be incomplete, are removed unless something else uses them."""
    old_group, old_world = own_trees(group)
    names = _names_to_keep(response, (old_group, old_world))
    left = [part for each in (old_group, old_world) for part in parts_of(each)]
    for each in filter(is_diffraction, bpy.data.node_groups):
        own = (response if each == group else response_in(each),)
        further = further_responses(each)
        if each.library is None and None not in own and (each == group or _is_among(old_group, further)):
            refill(each, (*own, *(response if one.group == old_group else one for one in further)))
    if old_group is not None:
        old_group.user_remap(response.group)  # for Diffraction Lamps
    for part in left:
        if part.users == 0:
            compat.remove_replaced(part)
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


def parts_of(tree: bpy.types.NodeTree | None) -> list[bpy.types.ID]:
    """A response's node group, followed by the images that it reads, without duplicates."""
    if tree is None:
        return []
    return [tree, *dict.fromkeys(node.image for node in _picture_nodes(tree) if node.image is not None)]


def _picture_nodes(tree: bpy.types.NodeTree) -> list[bpy.types.Node]:
    return [node for node in tree.nodes if node.type == "TEX_IMAGE"]
