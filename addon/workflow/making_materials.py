# SPDX-License-Identifier: GPL-3.0-or-later
"""Making a grating's node group and its material, varying them over the meshes that show it, and applying a grating's
settings as soon as an artist changes them."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.table.atlas import read_header
from ..gratings.bakes import note_region
from ..gratings.grating import ATTRIBUTE, LAMPS_ONLY, LIGHTS, NO_SAMPLE_SET, Grating, Variation
from ..gratings.own_names import follow_name, note_own
from ..materials.direct.direct_response import direct_response
from ..materials.group_properties import is_diffraction, variation_of
from ..materials.holograms.hologram_nodes import pattern_group, put_hologram
from ..materials.lost_parts import lost, lost_of_nodes, lost_of_own, replace_response
from ..materials.material import add_diffraction, diffraction_nodes, new_diffraction_material
from ..materials.response import Response, is_in_other_space, response_in, responses_in
from ..materials.skin import (
    answers_to_world,
    group_around,
    refill,
    set_up,
    set_variation,
    take_back,
    warnings_of,
)
from .directing import meshes_that_show
from .finding_bakes import bake_of
from .lights.lighting import update_all_lamps


def make_material(scene: bpy.types.Scene, grating: Grating) -> bpy.types.Material:
    """Make a new material from a grating's bake. Raises GratingError if there is no bake."""
    look, begin = grating.look, beginning_of(grating)  # first, because this may raise
    grating.material = new_diffraction_material(
        grating.name, group_of(scene, grating), base_color=look.base_color, base_roughness=look.base_roughness
    )
    note_own(grating.material)
    begin(diffraction_nodes(grating.material))
    return grating.material


def beginning_of(grating: Grating) -> Callable[[Iterable[bpy.types.Node]], None]:
    """A function that gives new Diffraction nodes the values and the hologram of the grating's look. Raises
    GratingError if the look is damaged."""
    inputs, hologram = grating.look.inputs_for(grating.name), grating.look.hologram_for(grating.name)

    def begin(nodes: Iterable[bpy.types.Node]) -> None:
        for node in nodes:
            for name, value in inputs.items():
                node.inputs[name].default_value = value
            if hologram is not None:
                put_hologram(node, pattern_group(hologram.pattern.upper()), hologram.inputs)

    return begin


def working_material(scene: bpy.types.Scene, grating: Grating) -> bpy.types.Material:
    """The grating's own material, in working order: made if missing, repaired if its Diffraction node was deleted or
    unlinked. Raises GratingError if there is no bake."""
    group = group_of(scene, grating)
    if grating.material is None:
        return make_material(scene, grating)
    try:
        add_diffraction(grating.material, group)
    except GratingError:  # linked, or without a Material Output
        return make_material(scene, grating)
    return grating.material


def group_of(scene: bpy.types.Scene, grating: Grating) -> bpy.types.NodeTree:
    """The Diffraction group of a baked grating, made if missing. From then on, all scenes follow their lamps.

    If the group lost a part, such as a deleted picture, it is repaired from the bake. Raises GratingError, with nothing
    changed, if that needs a bake and there is no valid one."""
    group, bake = take_back(grating.own_group), needed_bake(grating)
    response = None if bake is None else response_of(bake)  # first, because this may raise
    update_all_lamps()
    if group is None:
        assert response is not None  # needed_bake names a bake where there is no group
        grating.group = group_around(grating.name, response, **grating.settings())
        note_own(grating.group)
    elif response is not None:
        replace_response(group, response)
    elif lost_of_nodes(group):
        refill(group, responses_in(group))
    set_up(grating.group, **grating.settings())
    follow_name(grating)
    keep_exact_normals(scene)
    return grating.group


def keep_exact_normals(scene: bpy.types.Scene) -> None:
    """Let EEVEE store normals exactly. By default it has ten bits for each, which on a sphere changes colours by 1.5 %
    (median) and up to 10 % (95th percentile)."""
    scene.render.use_high_quality_normals = True


def needed_bake(grating: Grating) -> Path | None:
    """The bake's file if the grating's group must be made or repaired from it, else None. Raises GratingError as
    bake_of."""
    group = take_back(grating.own_group)
    response = None if group is None or lost_of_own(group) else response_in(group)
    if response is None or is_in_other_space(response):
        return bake_of(grating)
    return None


def read_combs() -> None:
    """Make all gratings of the file use the combs on its meshes, after the first mesh was combed."""
    for scene in bpy.data.scenes:
        for grating in scene.natural_gratings.items:
            if take_back(grating.own_group) is not None:
                set_up(grating.own_group, frame=grating.frame_source())


def refresh_group(grating: Grating) -> None:
    """Switch the grating's Diffraction group, if any, to the grating's present bake. Materials keep their links and
    settings. Raises GratingError, with nothing changed, if the file is not a bake."""
    if take_back(grating.own_group) is not None:
        replace_response(grating.group, response_of(bake_of(grating)))
        set_up(grating.group, shadows=grating.shadows, lights=grating.lit_by)


def choose_lights(grating: Grating, lights: str) -> list[str]:
    """Set which lights a grating's materials respond to (gratings/grating.py). Returns lines to report."""
    grating.lights = lights
    label = next(label for name, label, _ in LIGHTS if name == lights)
    report = [f"{grating.name}: {label}, shadows {'on' if grating.shadows else 'off'}"]
    group = take_back(grating.own_group)
    if group is None:
        return report
    set_up(group, shadows=grating.shadows, lights=lights)
    return report + lamps_alone(grating) + lost([group]) + warnings_of(group)


def lamps_alone(grating: Grating) -> list[str]:
    """A warning if a grating is set to respond to more than lamps, but its bake cannot."""
    group = grating.group
    lacking = group is not None and grating.lit_by != LAMPS_ONLY and not answers_to_world(group)
    return [f"{grating.name}: {NO_SAMPLE_SET}"] if lacking else []


def response_of(path: Path) -> Response:
    """The response from a bake's file, with a note of the bake's region. Raises GratingError if the file is not a
    bake."""
    response = direct_response(path)
    layout, _ = read_header(path)
    note_region(response.group, layout)
    return response


def follow_settings(first: bpy.types.Scene | None = None) -> None:
    """Apply the switches of the file's gratings to their materials. Nodes that are right already stay. If
    scenes share a material, as a copied scene does, the settings of the scene `first` count."""
    done: set[bpy.types.NodeTree] = set()
    for scene in sorted(bpy.data.scenes, key=lambda scene: scene != first):
        gratings: Iterable[Any] = scene.natural_gratings.items if scene.library is None else ()
        for grating in gratings:
            group = grating.own_group
            if is_diffraction(group) and group not in done:
                done.add(group)
                set_up(group, shadows=grating.shadows, footprint=grating.footprint, every_lamp=grating.every_lamp)


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
    return [f"{grating.name}: {choice.summary}", *prepare_meshes(group, meshes), *unseen, *warnings_of(group)]


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
