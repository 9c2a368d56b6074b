# SPDX-License-Identifier: GPL-3.0-or-later
"""Varying a grating over the meshes that show it."""

from collections.abc import Iterable, Sequence

import bpy

from ...precompute.base.failure import GratingError
from ..gratings.grating import Grating
from ..gratings.variation import ATTRIBUTE, Variation
from ..materials.group_properties import variation_of
from ..materials.response import Response, response_in, responses_in
from ..materials.skin import crowded, set_variation
from .choosing_direction import meshes_that_show
from .making_materials import group_of, needed_bake


def vary(scene: bpy.types.Scene, grating: Grating, choice: Variation, *, others: Sequence[Grating]) -> list[str]:
    """Vary all materials of a grating over the surface, between the grating and `others`, one for each share of
    `choice`. Returns lines to report. Raises GratingError, with nothing changed, if a grating is not baked or is named
    twice, if the shares add up to more than 1, or if the pattern's attribute has no name."""
    twice = [each.name for k, each in enumerate(others) if each in (grating, *others[:k])]
    if twice:
        raise GratingError(grating.name, f"{twice[0]} is named twice", "choose another grating to vary it with")
    if sum(choice.shares) > 1.0 + 1e-6:
        raise GratingError(
            grating.name, f"the others cover {sum(choice.shares):.0%} of the surface", "lower their shares to 100%"
        )
    if choice.shares and choice.pattern == ATTRIBUTE and not choice.attribute:
        raise GratingError(grating.name, "its Pattern needs an Attribute", "name one, such as scale_random")
    for each in (grating, *others):
        needed_bake(each)
    group = group_of(scene, grating)
    set_variation(group, choice, [_response_of(scene, other) for other in others])
    meshes = meshes_that_show(group)
    unseen = [] if meshes else [f"{grating.name}: no mesh shows it yet; press Assign to Selected"]
    return [f"{grating.name}: {choice.summary}", *prepare_meshes(group, meshes), *unseen, *crowded(group)]


def _response_of(scene: bpy.types.Scene, grating: Grating) -> Response:
    response = response_in(group_of(scene, grating))
    assert response is not None  # group_of repairs a group that lost its response
    return response


def varied_with(scene: bpy.types.Scene, grating: Grating) -> list[Grating]:
    """The scene's gratings that a grating is varied with, in order."""
    if grating.group is None:
        return []
    by_response = {response_in(each.group): each for each in scene.natural_gratings.items if each.group is not None}
    return [by_response[response] for response in responses_in(grating.group)[1:] if response in by_response]


def prepare_meshes(group: bpy.types.NodeTree, meshes: Iterable[bpy.types.Object]) -> list[str]:
    """Make meshes store the rest position of their vertices, before modifiers and shape keys, on which the variation is
    based. Returns a line for each mesh that lacks the pattern's attribute."""
    choice, lines = variation_of(group), []
    for mesh in meshes if choice != Variation() else ():
        if mesh.library is None and mesh.override_library is None:
            mesh.add_rest_position_attribute = True
        if choice.pattern_attribute and choice.pattern_attribute not in mesh.data.attributes:
            lines.append(f"{mesh.name}: has no attribute {choice.pattern_attribute}; it shows the first grating alone")
    return lines
