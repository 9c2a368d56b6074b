# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding presets as gratings of a scene, Show Me (a new scene with a preset on a thing, lit and ready to render), and
adding nodes to the tree that an artist has open in the shader editor.

New nodes are selected, and the first is active, so that they can follow the mouse together."""

import json
from dataclasses import dataclass

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.presets.presets import SNAKES, Preset, read_preset
from ..direction.uv_maps import has_uv_map
from ..gratings.direction_source import AXIS, DIRECTION_REMEDY, RADIAL, STORED, DirectionSource
from ..gratings.grating import Grating, active_grating, request_record, unused_name
from ..materials.holograms.hologram_nodes import add_pattern, pattern_group
from ..materials.holograms.patterns import LABELS
from ..materials.material import LABEL, check_can_change, overfull, tell_cycles
from ..showcase.show_views import MARK
from ..showcase.stage import STAGES, add_thing, set_stage
from .assigning import add_to_meshes, assign_to_meshes, further, prepared
from .baking import bake_and_wait, take_draft
from .chosen_meshes import meshes_among
from .directing import choose_frame
from .importing import add_averaged, keep_if_new
from .making_materials import beginning_of, group_of
from .varying_inputs import fit_hologram, fit_pattern

# The source of the scan's direction for each direction of a preset. A disc's axis is its object's Z axis.
SOURCES = {"stored": DirectionSource(STORED), "radial": DirectionSource(RADIAL, axis="Z")}


def add_preset(scene: bpy.types.Scene, name: str) -> Grating:
    """Add a preset as the scene's active grating. Raises GratingError, with none added, for an unknown name or a faulty
    file."""
    preset = read_preset(name)
    grating = add_averaged(scene, request_record(preset.request)["scans"])
    grating.take_request(preset.request)
    grating.take_frame_source(SOURCES[preset.direction])
    _take_look(grating, preset)
    grating.name = unused_name(preset.title, {each.name for each in scene.natural_gratings.items[:-1]})
    return grating


def import_preset(scene: bpy.types.Scene, name: str) -> str:
    """Add a preset at draft quality, with its shipped draft if there is one. If the list has an identical grating
    already, that one becomes active instead. Returns a line for the grating. Raises GratingError as add_preset does."""
    take_draft(add_preset(scene, name), read_preset(name))
    return keep_if_new(scene)


def put_preset(scene: bpy.types.Scene, name: str, objects: list[bpy.types.Object]) -> list[str]:
    """Add a preset as import_preset does, bake it if no draft ships, and put it on the meshes among the objects. Where
    a mesh has no UV map, the direction follows the objects' Z axis. Returns lines to report. Raises GratingError as
    add_preset and assign_to_meshes do, with nothing added if a mesh cannot carry it."""
    source, lines = SOURCES[read_preset(name).direction], []
    bare = [thing.name for thing in objects if thing.type == "MESH" and not has_uv_map(thing.data, source)]
    if bare:
        source = DirectionSource(AXIS, axis="Z")
        lines = [f"{', '.join(bare)}: no UV map, so the direction follows the object's Z axis; Direction changes it"]
    meshes_among(scene, objects, source)  # first, because it may raise
    import_preset(scene, name)
    grating = active_grating(scene)
    if bare:
        choose_frame(grating, source)
    if not grating.bake_path:
        bake_and_wait(grating)
    return [*assign_to_meshes(scene, objects), *lines]


def _take_look(grating: Grating, preset: Preset) -> None:
    """Keep what the grating's material begins with."""
    grating.look.base_color, grating.look.base_roughness = preset.base_color, preset.base_roughness
    grating.look.inputs = json.dumps(dict(preset.inputs), sort_keys=True) if preset.inputs else ""
    grating.look.hologram = json.dumps(preset.hologram.as_dict(), sort_keys=True) if preset.hologram else ""


def show_preset(name: str) -> bpy.types.Scene:
    """Make a scene that shows a preset at draft quality. All other scenes stay as they are. Returns the scene. Raises
    GratingError, with no scene left, for an unknown preset or if its draft has to be baked and cannot be."""
    preset = read_preset(name)
    scene = bpy.data.scenes.new(f"Show Me: {preset.title}")
    try:
        grating = add_preset(scene, name)
        if not take_draft(grating, preset):
            bake_and_wait(grating)
        set_stage(scene, STAGES[preset.shape])
        thing = add_thing(scene, preset.shape, preset.title)
        # A snake keeps its own skin below the grating.
        (add_to_meshes if preset.shape in SNAKES else assign_to_meshes)(scene, [thing])
    except BaseException:
        bpy.data.scenes.remove(scene)
        raise
    scene[MARK] = True
    # Active but not selected: an outline would hide the colours of its rim.
    scene.view_layers[0].objects.active = thing
    return scene


@dataclass(frozen=True)
class Place:
    """Where a node is added: a material, its own node tree or a group's in it that is open, and the node's location."""

    material: bpy.types.Material
    tree: bpy.types.ShaderNodeTree
    location: tuple[float, float]


def add_grating_node(scene: bpy.types.Scene, name: str, place: Place) -> list[str]:
    """Add the Diffraction group of a scene's grating; the active one's if the name is empty. Its inputs begin as the
    grating's look says. Returns lines to report. Raises GratingError, with nothing added, if there is no such grating,
    it is not baked, its look is damaged, or the material cannot be changed."""
    grating = _grating(scene, name)
    check_can_change(place.material)
    if grating.own_group is not None and grating.own_group.contains_tree(place.tree):
        raise GratingError(grating.name, "its own node group is open", "press Tab to leave the group first")
    begin, group = beginning_of(grating), group_of(scene, grating)
    _deselect(place.tree)
    node = place.tree.nodes.new("ShaderNodeGroup")
    node.node_tree, node.label, node.location = group, LABEL, place.location
    node.width = group.default_group_node_width
    begin([node])
    place.tree.nodes.active = node
    meshes = _meshes_with(scene, place.material)
    fit_hologram([node], meshes)
    tell_cycles(place.material)
    source = grating.frame_source()
    bare = [f"{each.name}: no UV map, so no direction for the grating; {DIRECTION_REMEDY}"
            for each in meshes if not has_uv_map(each.data, source)]  # fmt: skip
    warnings = [*bare, *prepared(meshes, grating), *further(scene, grating), *overfull([place.material])]
    return [f"{grating.name}: added to {place.material.name}; link its Shader output", *warnings]


def add_preset_node(scene: bpy.types.Scene, preset: str, place: Place) -> list[str]:
    """Add a preset to the scene's gratings, baked at draft quality if no draft ships, and its Diffraction group.
    Returns lines to report. Raises GratingError, with nothing added, for an unknown preset or a faulty file, or if the
    material cannot be changed."""
    check_can_change(place.material)
    line = import_preset(scene, preset)
    grating = active_grating(scene)
    if not grating.bake_path:
        bake_and_wait(grating)
    added, *warnings = add_grating_node(scene, "", place)
    return [added, line, *warnings]


def add_pattern_node(scene: bpy.types.Scene, pattern: str, place: Place) -> list[str]:
    """Add the node of a hologram's pattern, with a UV Map node, and fit its cells to a mesh with the material. Returns
    lines to report. Raises GratingError, with nothing added, if the material cannot be changed."""
    check_can_change(place.material)
    _deselect(place.tree)
    node = add_pattern(place.tree, pattern_group(pattern), place.location)
    place.tree.nodes.active = node
    fit_pattern(node, _meshes_with(scene, place.material))
    return [f"{LABELS[pattern]}: added to {place.material.name}; link its outputs to a Diffraction node"]


def _deselect(tree: bpy.types.NodeTree) -> None:
    """Deselect a tree's nodes, so that the new ones, which Blender selects, are the only selected ones."""
    for node in tree.nodes:
        node.select = False


def _grating(scene: bpy.types.Scene, name: str) -> Grating:
    """The scene's grating with a name, the active one if it is empty. Raises GratingError if there is none."""
    if not name:
        return active_grating(scene)
    for grating in scene.natural_gratings.items:
        if grating.name == name:
            return grating
    raise GratingError(name, f"no such grating in scene {scene.name}", "choose one of the list in the Grating panel")


def _meshes_with(scene: bpy.types.Scene, material: bpy.types.Material) -> list[bpy.types.Object]:
    """The scene's meshes with a material that are not in Edit Mode, where UV maps cannot be read."""
    meshes = (thing for thing in scene.objects if thing.type == "MESH" and not thing.data.is_editmode)
    return [mesh for mesh in meshes if any(slot.material == material for slot in mesh.material_slots)]
