# SPDX-License-Identifier: GPL-3.0-or-later
"""Repairing the file's diffraction materials after data-blocks in them were deleted, replaced or edited."""

from collections.abc import Iterable, Iterator
from typing import Any

import bpy

from ...precompute.base.failure import GratingError
from ..gratings.grating import Grating
from ..materials.group_properties import diffraction_groups
from ..materials.lost_parts import faults_of, lost_of_nodes, lost_of_own
from ..materials.material import add_diffraction, empty_nodes
from ..materials.replace import replace_response
from ..materials.response import responses_in
from ..materials.skin import refill, take_back
from .following_lamps import update_all_lamps
from .making_materials import group_of, response_of
from .restoring_bakes import bake_shown_by


def mend_materials() -> list[GratingError | str]:
    """Repair the file's Diffraction groups from their bakes, and materials with an empty Diffraction node. Returns
    lines to report: repairs, then failures with their remedies. Raises GratingError if nothing could be repaired."""
    mended: list[str] = []
    faults: list[GratingError] = []
    for tree in bpy.data.node_groups:
        if tree.library is None:
            take_back(tree)
    owners: dict[Any, tuple[bpy.types.Scene, Grating]] = {
        grating.own_group: (scene, grating) for scene, grating in _gratings()
    }
    update_all_lamps()
    for group in filter(_is_broken, _groups()):
        try:
            _mend(group, owners.get(group))
            mended.append(group.name)
        except GratingError as error:
            faults.append(error)
    for material in filter(empty_nodes, _materials()):
        try:
            add_diffraction(material, _group_for(material))
            mended.append(material.name)
        except GratingError as error:
            faults.append(error)
    faults += faults_of(_groups())
    if not mended and faults:
        raise faults[0]
    done = f"mended: {', '.join(mended)}" if mended else "every diffraction material is whole"
    return [done, *{str(fault): fault for fault in faults}.values()]


def _mend(group: bpy.types.NodeTree, owner: tuple[bpy.types.Scene, Grating] | None) -> None:
    if not lost_of_own(group):
        refill(group, responses_in(group))
    elif owner is not None:
        group_of(*owner)
    else:
        replace_response(group, response_of(bake_shown_by(group)))


def _group_for(material: bpy.types.Material) -> bpy.types.NodeTree:
    """The Diffraction group for a material whose Diffraction node is empty: of the grating that made the material, else
    of the file's only grating. Raises GratingError if there is neither."""
    gratings = list(_gratings())
    owners = [(scene, grating) for scene, grating in gratings if grating.material == material] or [
        (scene, grating) for scene, grating in gratings if len(gratings) == 1
    ]
    if not owners:
        raise GratingError(material.name, "its Diffraction node is empty", "choose a grating, then Add to Materials")
    return group_of(*owners[0])


def _gratings() -> Iterator[tuple[bpy.types.Scene, Grating]]:
    for scene in bpy.data.scenes:
        gratings: Iterable[Grating] = scene.natural_gratings.items if scene.library is None else ()
        for grating in gratings:
            yield scene, grating


def _groups() -> list[bpy.types.NodeTree]:
    return [group for group in diffraction_groups() if group.library is None]


def _materials() -> list[bpy.types.Material]:
    return [material for material in bpy.data.materials if material.library is None]


def _is_broken(group: bpy.types.NodeTree) -> bool:
    return bool(lost_of_own(group) or lost_of_nodes(group))
