# SPDX-License-Identifier: GPL-3.0-or-later
"""Adopting Diffraction groups that belong to no grating of the scene (appended, pasted, or left by a removed grating),
and repairing the file's diffraction materials after data-blocks in them were deleted, replaced or edited.

An adopted grating takes the look of its material: what a further material then begins with."""

import contextlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from math import isfinite
from typing import Any

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.presets.presets import INPUTS, PATTERNS, PresetHologram
from ..blender.guard import kept_path
from ..gratings.bakes import noted_region
from ..gratings.grating import Grating, unused_name
from ..gratings.own_names import follow_name, name_in, note_own, was_own
from ..materials.group_properties import (
    answers_every_lamp,
    counts_footprint,
    diffraction_groups,
    frame_of,
    lights_of,
    traces_shadows,
)
from ..materials.holograms import patterns
from ..materials.holograms.hologram_nodes import hologram_of, input_set_by_artist, pattern_of
from ..materials.lost_parts import faults_of, lost_of_nodes, lost_of_own, replace_response
from ..materials.material import (
    add_diffraction,
    diffraction_nodes,
    empty_nodes,
    linked_strays,
    materials_with,
    owners,
    strays,
)
from ..materials.pictures import made_from, parts_of, remove_unused
from ..materials.response import own_trees, responses_in
from ..materials.skin import SETTABLE, refill, take_back
from .finding_bakes import bake_shown_by
from .lights.lighting import update_all_lamps
from .loading_bakes import take_bake
from .making_materials import group_of, keep_exact_normals, response_of
from .varying_inputs import fit_adopted_hologram

# Digits of a number. Single precision, in which Blender stores it, has seven.
_DIGITS = 6


def take_look(grating: Grating, material: bpy.types.Material) -> None:
    """Set a grating's look from a material that shows it: the values of its Diffraction node, its pattern, and its base
    if the extension made the material. What a look cannot hold, such as a picture, is left out."""
    node = next((each for each in diffraction_nodes(material) if each.node_tree == grating.group), None)
    if node is None:
        return
    inputs = _changed(
        INPUTS,
        {name: socket.default for name, socket in SETTABLE.items()},
        lambda name: input_set_by_artist(node, name) if name in node.inputs else None,
    )
    grating.look.inputs = json.dumps(inputs, sort_keys=True) if inputs else ""
    _take_hologram(grating, hologram_of(node))
    if was_own(material):
        _take_base(grating, node)


def _take_hologram(grating: Grating, hologram: bpy.types.Node | None) -> None:
    pattern = "" if hologram is None else pattern_of(hologram.node_tree)
    name = pattern.lower()
    if hologram is None or name not in PATTERNS:
        grating.look.hologram = ""
        return
    defaults = {socket.name: socket.default for socket in patterns.INPUTS[pattern]}
    made = PresetHologram(name, _changed(PATTERNS[name], defaults, hologram.inputs.get))
    grating.look.hologram = json.dumps(made.as_dict(), sort_keys=True)


def _take_base(grating: Grating, node: bpy.types.Node) -> None:
    links = node.inputs["Base"].links if "Base" in node.inputs else ()
    base = links[0].from_node if links else None
    if base is None or base.type != "BSDF_PRINCIPLED":
        return
    colour, roughness = base.inputs["Base Color"], base.inputs["Roughness"]
    if not colour.is_linked:
        grating.look.base_color = colour.default_value[:3]
    if not roughness.is_linked:
        grating.look.base_roughness = roughness.default_value


def _changed(
    limits: Mapping[str, tuple[float, float]],
    defaults: Mapping[str, float | None],
    socket_of: Callable[[str], bpy.types.NodeSocket | None],
) -> dict[str, float]:
    """The numbers of the inputs in `limits` that are not the defaults."""
    found = {}
    for name, (low, high) in limits.items():
        value = getattr(socket_of(name), "default_value", None)  # an artist may have deleted the socket
        if isinstance(value, float) and isfinite(value) and low <= (shown := float(f"{value:.{_DIGITS}g}")) <= high:
            default = defaults[name]
            if default is None or shown != float(f"{default:.{_DIGITS}g}"):
                found[name] = shown
    return found


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
    """The scene's grating with a group's bake, or None."""
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
    remove_unused(left)


def _new_grating(scene: bpy.types.Scene, group: bpy.types.NodeTree) -> Grating:
    """Make a grating from a group, and make it the scene's active one. Raises GratingError if its bake is lost."""
    path = kept_path(str(bake_shown_by(group)))
    gratings = scene.natural_gratings
    name = unused_name(name_in(group), {grating.name for grating in gratings.items})
    grating = gratings.items.add()
    grating.name, grating.bake_path = name, path
    with contextlib.suppress(GratingError):  # a bake of another version; its pictures still show it
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
