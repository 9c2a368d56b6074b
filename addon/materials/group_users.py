# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects show a Diffraction group, and which groups in a scene belong to no grating of it."""

from collections.abc import Iterable
from collections.abc import Set as AbstractSet
from pathlib import Path

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from ..gratings.wording import translated
from ..lamps.follow import lamp_count
from .group_properties import diffraction_groups, lamps_in
from .material import diffraction_nodes
from .pictures import pictures_of
from .response import own_trees

# The number of object names that fit into a line of the panel.
_NAMES_MAX = 3


def materials_with(group: bpy.types.NodeTree) -> list[bpy.types.Material]:
    """The file's materials that contain a Diffraction group, also inside another group, by name."""
    return sorted(_materials_of({group}), key=lambda material: material.name_full)


def _materials_of(groups: set[bpy.types.NodeTree]) -> set[bpy.types.Material]:
    """The file's materials that contain one of these Diffraction groups."""
    found, seen, pending = set(), set(), groups
    while pending:
        seen |= pending
        users = _users(pending, "MATERIAL", "NODETREE")
        found |= {user for user in users if isinstance(user, bpy.types.Material)}
        pending = {user for user in users if isinstance(user, bpy.types.NodeTree)} - seen
    return {m for m in found if any(node.node_tree in groups for node in diffraction_nodes(m))}


def shown_by(group: bpy.types.NodeTree | None) -> list[bpy.types.Object]:
    """The file's objects whose materials contain a Diffraction group, by name. Of a linked object and its library
    override, only the override."""
    shown = set() if group is None else _objects_with(_materials_of({group}))
    overridden = {thing.override_library.reference for thing in shown if thing.override_library is not None}
    return sorted(shown - overridden, key=lambda thing: thing.name_full)


def _objects_with(materials: set[bpy.types.Material]) -> set[bpy.types.Object]:
    """The file's objects that have one of these materials."""
    users = _users(materials)
    objects = {user for user in users | _users(users, "OBJECT") if isinstance(user, bpy.types.Object)}
    return {thing for thing in objects if any(slot.material in materials for slot in thing.material_slots)}


def boxes_showing(scene: bpy.types.Scene) -> np.ndarray:
    """The bounding boxes (n, 2, 3) of the scene's objects that show diffraction: minimum and maximum corners in world
    space. Objects that appear only in collection instances are left out."""
    corners = np.array([_corners(thing) for thing in _showing(scene)]).reshape(-1, 8, 3)
    return np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1)


def outside_light_groups(scene: bpy.types.Scene) -> list[str]:
    """One warning line if the scene has light groups and objects whose diffraction is in none of them. Diffraction is
    emission to Cycles, which files it under the light group of the object, not of the lamp."""
    if scene.render.engine != "CYCLES" or not any(layer.lightgroups for layer in scene.view_layers):
        return []
    outside = sorted((thing for thing in _showing(scene) if not thing.lightgroup), key=lambda thing: thing.name)
    remedy = "give the object a light group of its own (Object > Shading)"
    return [f"no light group has the diffraction of {listed(outside)}; {remedy}"] if outside else []


def _showing(scene: bpy.types.Scene) -> set[bpy.types.Object]:
    """The scene's objects that show diffraction."""
    shown = _objects_with(_materials_of(set(diffraction_groups())))
    return shown & set(scene.collection.all_objects) if shown else shown


def _corners(thing: bpy.types.Object) -> np.ndarray:
    """The corners (8, 3) of an object's bounding box in world space, as it was last evaluated."""
    matrix = np.array(thing.matrix_world)
    return np.array([corner[:] for corner in thing.bound_box]) @ matrix[:3, :3].T + matrix[:3, 3]


def on_objects(objects: list[bpy.types.Object]) -> str:
    """One line that names objects: "On: Snake, Ball and 3 more"."""
    return translated("On: {names}", names=listed(objects)) if objects else translated("On no object")


def listed(things: Iterable[bpy.types.ID]) -> str:
    """The names of data-blocks: "Sun, Lamp and 3 more"."""
    names = [thing.name for thing in things]
    if len(names) > _NAMES_MAX:
        names = [*names[: _NAMES_MAX - 1], translated("{count} more", count=len(names) - _NAMES_MAX + 1)]
    if len(names) < 2:
        return "".join(names)
    return translated("{names} and {last}", names=", ".join(names[:-1]), last=names[-1])


def strays(scene: bpy.types.Scene) -> list[bpy.types.NodeTree]:
    """The Diffraction groups of bakes that objects show but no grating of the scene owns, so the panel does not list
    them: appended, pasted, linked, or left by a removed grating. Groups of other scenes count if objects here show
    them."""
    own = {grating.group for grating in scene.natural_gratings.items}
    groups = [group for group in diffraction_groups() if group not in own]
    return [group for group in groups if _shows_bake(group) and _is_stray(group, scene)]


def linked_strays(scene: bpy.types.Scene, groups: list[bpy.types.NodeTree]) -> list[GratingError]:
    """One error for each stray group that is linked from another file. It says if the scene has more lamps than the
    group reads, as a linked group cannot be changed."""
    remedy = "to adopt it, select its objects and use Object > Relations > Make Local > All first"
    count = lamp_count(scene)
    return [
        GratingError(group.name, _linked_with(group, count), remedy) for group in groups if group.library is not None
    ]


def _linked_with(group: bpy.types.NodeTree, lamps: int) -> str:
    read, linked = len(lamps_in(group)), f"linked from {Path(group.library.filepath).name}"
    return f"{linked} with only {read} of {lamps} lamps" if read < lamps else linked


def owners(group: bpy.types.NodeTree) -> list[bpy.types.Scene]:
    """The file's scenes with a grating that owns a Diffraction group."""
    return [s for s in bpy.data.scenes if any(grating.group == group for grating in s.natural_gratings.items)]


def _is_stray(group: bpy.types.NodeTree, scene: bpy.types.Scene) -> bool:
    """Whether to offer a Diffraction group to the scene, given that no grating of the scene owns it."""
    things = shown_by(group)
    return any(scene in thing.users_scene for thing in things) if owners(group) else bool(things)


def _shows_bake(group: bpy.types.NodeTree) -> bool:
    """Whether a Diffraction group shows a bake, not an OSL shader."""
    tree, _ = own_trees(group)
    return tree is not None and bool(pictures_of(tree))


def _users(used: AbstractSet[bpy.types.ID], *kinds: str) -> set[bpy.types.ID]:
    """The data-blocks that use any of these, of the given kinds or of all."""
    found = bpy.data.user_map(subset=used, **({"value_types": set(kinds)} if kinds else {})) if used else {}
    return set().union(*found.values())
