# SPDX-License-Identifier: GPL-3.0-or-later
"""Adopting Diffraction groups that belong to no grating of the scene: appended, pasted, or left by a removed
grating."""

import contextlib

import bpy

from ...precompute.base.failure import GratingError
from ..blender import compat
from ..blender.paths import kept_path
from ..gratings.baked_region import noted_region
from ..gratings.grating import Grating, unused_name
from ..gratings.own_names import follow_name, name_in, note_own, was_own
from ..materials.group_properties import answers_every_lamp, counts_footprint, frame_of, lights_of, traces_shadows
from ..materials.group_users import linked_strays, materials_with, owners, strays
from ..materials.pictures import made_from
from ..materials.replace import parts_of
from ..materials.response import own_trees
from .adding_holograms import fit_adopted_hologram
from .loading_bakes import take_bake
from .making_materials import keep_exact_normals
from .restoring_bakes import bake_shown_by
from .taking_looks import take_look


def adopt(scene: bpy.types.Scene) -> list[GratingError | str]:
    """Connect stray Diffraction groups to the scene's gratings. A group with the same bake as a grating in the list is
    replaced by that grating's group; any other group becomes a new grating. Returns lines to report: what was done,
    then what could not be adopted, with the remedy. Raises GratingError if nothing could be adopted."""
    found = strays(scene)
    done: list[str] = []
    faults = linked_strays(scene, found)
    for group in (group for group in found if group.library is None):
        name, materials = group.name, [each for each in materials_with(group) if each.library is None]
        try:
            twin = None if owners(group) else _of_same_bake(scene, group)
            if twin is not None:
                _follow(group, twin)
                done.append(f"{name}: follows {twin.name}")
            else:
                done.append(f"{name}: is now the grating {_new_grating(scene, group).name}")
            for material in materials:
                fit_adopted_hologram(material)
        except GratingError as error:
            faults.append(error)
    if done:
        keep_exact_normals(scene)
    else:
        raise faults[0] if faults else GratingError("", "every diffraction material is in the list already", "")
    return [*done, *faults]


def _of_same_bake(scene: bpy.types.Scene, group: bpy.types.NodeTree) -> Grating | None:
    """The scene's grating with a group's bake, or None. Groups of earlier versions do not record their bake."""
    bake = made_from(own_trees(group)[0])
    for grating in scene.natural_gratings.items if bake else ():
        if grating.own_group is not None and made_from(own_trees(grating.group)[0]) == bake:
            return grating
    return None


def _follow(group: bpy.types.NodeTree, grating: Grating) -> None:
    """Replace a group by the grating's own everywhere, and delete the group and its copies of pictures."""
    held = [node.node_tree for node in group.nodes if node.type == "GROUP"]
    left = [group, *(part for tree in held for part in parts_of(tree))]
    group.user_remap(grating.group)
    for each in left:  # a picture follows the groups that use it, so it is deleted after the last of them
        if each.users == 0:
            compat.remove_replaced(each)


def _new_grating(scene: bpy.types.Scene, group: bpy.types.NodeTree) -> Grating:
    """Make a grating from a group, and make it the scene's active one. Raises GratingError if its bake is lost."""
    path = kept_path(str(bake_shown_by(group)))
    gratings = scene.natural_gratings
    name = unused_name(name_in(group), {grating.name for grating in gratings.items})
    grating = gratings.items.add()
    grating.name, grating.bake_path = name, path
    with contextlib.suppress(GratingError):  # a bake of an earlier version; its pictures still show it
        take_bake(grating, path)  # before the grating has its group, which this would make anew
    tree, _ = own_trees(group)
    grating.for_scene = tree is not None and noted_region(tree) is not None
    grating.lights, grating.shadows = lights_of(group), traces_shadows(group)
    grating.footprint, grating.every_lamp = counts_footprint(group), answers_every_lamp(group)
    grating.take_frame_source(frame_of(group))
    grating.group = group
    grating.material = next((m for m in materials_with(group) if m.library is None and was_own(m)), None)
    if not owners(group)[1:]:  # if two scenes share the group, its names stay those of the first
        for made in filter(None, (group if was_own(group) else None, grating.material)):
            note_own(made)
        follow_name(grating)
    gratings.active_index = len(gratings.items) - 1
    shown_in = [grating.material, *materials_with(group)]
    take_look(grating, next(filter(None, shown_in)))
    return grating
