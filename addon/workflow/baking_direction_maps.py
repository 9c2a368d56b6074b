# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking the direction of a mesh's grating into a direction map (direction/direction_map.py).

Cycles bakes a copy of the mesh, in a separate scene, with the material's own direction nodes. So the map is exact at
pixel centres, and the artist's scene stays unchanged."""

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from ...precompute.base.files import told_of, write_whole
from ..blender.written import check_picture
from ..direction.direction_map import baking_material, new_map, note_mesh
from ..direction.uv_maps import has_uv_map
from ..gratings.direction_source import FRAME_MAP, DirectionSource
from ..materials.group_properties import frame_of
from ..materials.material import diffraction_nodes
from .choosing_direction import choose_frame
from .chosen_meshes import check_not_edited

# Tolerance for UVs outside the unit square, for single precision.
_RIM = 1e-4


def bake_direction_map(
    context: bpy.types.Context, mesh: bpy.types.Object, *, uv_map: str = "", size: int = 1024, margin: int = 8,
    path: Path | None = None, read: bool = True,
) -> list[str]:  # fmt: skip
    """Bake the direction of a mesh's grating, without Rotation, into a new picture on a UV map, by default the active
    one. The picture is packed into the .blend and, if `path` is given, also written there. `read`: the mesh's gratings
    use it from now on. Returns lines to report.

    Raises GratingError, with nothing changed, if the mesh lacks the UV map, or has no direction to bake."""
    layer = _map_of(mesh, uv_map)
    sources = _sources(context, mesh)
    if path is not None and path.suffix.lower() != ".exr":
        raise GratingError(path, "a direction map is written as OpenEXR", "give it a name that ends in .exr")
    image = new_map(f"{mesh.name} {layer.name} frame", size)
    try:
        materials = [baking_material(source, layer.name, image) for source in sources]
        with _stage(context, mesh, materials) as override, context.temp_override(**override):
            bpy.ops.object.bake(type="EMIT", uv_layer=layer.name, use_clear=True, margin=margin, margin_type="EXTEND")
        image.pack()
        note_mesh(image, mesh, layer.name)
        if path is not None:
            write_map(image, path)
    except RuntimeError as error:  # from Blender's own operators
        bpy.data.images.remove(image)
        told = " ".join(str(error).split()).removeprefix("Error: ")
        raise GratingError(mesh.name, f"Cycles cannot bake its direction map ({told})", "enable Cycles") from error
    except BaseException:
        bpy.data.images.remove(image)
        raise
    image.use_fake_user = not read
    done = f"{image.name}: the direction on {mesh.name}, {size} x {size} pixels on its UV map {layer.name}"
    return [done, *(_have_read(mesh, image) if read else [])]


def write_map(image: bpy.types.Image, path: Path) -> None:
    """Write a picture to a file of its own kind, whole or not at all. Raises GratingError or RuntimeError."""

    def write(partial: Path) -> None:
        image.save(filepath=str(partial), save_copy=True)
        check_picture(partial, (image.size[0], image.size[1]), alpha=image.depth == 128)

    with told_of(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path.resolve(), write)


def _map_of(mesh: bpy.types.Object, uv_map: str) -> bpy.types.MeshUVLoopLayer:
    """A mesh's UV map by name, by default the active one. Raises GratingError unless a picture fits on it."""
    data = mesh.data
    check_not_edited(mesh)
    if not data.polygons:
        raise GratingError(mesh.name, "no faces to bake a direction map of", "choose a mesh with faces")
    layer = data.uv_layers.get(uv_map) if uv_map else data.uv_layers.active
    if layer is None:
        fault = f"no UV map {uv_map}".rstrip() + " for a direction map"
        raise GratingError(mesh.name, fault, "unwrap it")
    uv = np.empty((len(data.loops), 2), np.float32)
    layer.uv.foreach_get("vector", uv.ravel())
    if uv.min() < -_RIM or uv.max() > 1 + _RIM:
        raise GratingError(mesh.name, f"its UV map {layer.name} leaves the picture's square", "unwrap it, or pack it")
    data.calc_loop_triangles()
    corners = np.empty((len(data.loop_triangles), 3), np.int32)
    data.loop_triangles.foreach_get("loops", corners.ravel())
    first, second, third = (uv[corners[:, each]] for each in range(3))
    one, other = second - first, third - first
    if not (one[:, 0] * other[:, 1] != one[:, 1] * other[:, 0]).any():
        raise GratingError(mesh.name, f"its UV map {layer.name} has no area", "unwrap it")
    return layer


def _sources(context: bpy.types.Context, mesh: bpy.types.Object) -> list[DirectionSource]:
    """The direction source of each slot's material; a slot without diffraction takes the active grating's. Raises
    GratingError if the source is a direction map already, or a UV map that the mesh lacks."""
    grating = context.scene.natural_gratings.active()
    default = DirectionSource() if grating is None else grating.frame_source()
    nodes = [diffraction_nodes(slot.material) for slot in mesh.material_slots] or [[]]
    sources = [frame_of(each[0].node_tree) if each else default for each in nodes]
    for source in sources:
        if source.kind == FRAME_MAP:
            raise GratingError(
                mesh.name, "its direction is from a direction map already", "choose another Direction Source"
            )
        if not has_uv_map(mesh.data, source):
            name = f"UV map {source.named_uv_map}" if source.named_uv_map else "UV map"
            raise GratingError(mesh.name, f"no {name}, so no direction to bake", "choose another Direction Source")
    return sources


@contextlib.contextmanager
def _stage(
    context: bpy.types.Context, mesh: bpy.types.Object, materials: list[bpy.types.Material]
) -> Iterator[dict[str, Any]]:
    """A copy of a mesh with its modifiers applied, alone in a temporary scene, with the given materials in its slots.
    Yields the context members to override. The scene, the copy and the materials are removed at the end."""
    depsgraph = context.evaluated_depsgraph_get()
    evaluated = mesh.evaluated_get(depsgraph)
    data = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=depsgraph)
    scene = bpy.data.scenes.new("Direction Map")
    try:
        while len(data.materials) < len(materials):
            data.materials.append(None)
        for slot, material in enumerate(materials):
            data.materials[slot] = material
        copy = bpy.data.objects.new("Direction Map", data)
        copy.matrix_world = evaluated.matrix_world
        scene.collection.objects.link(copy)
        scene.render.engine = "CYCLES"
        scene.cycles.samples, scene.cycles.device = 1, "CPU"
        layer = scene.view_layers[0]
        copy.select_set(True, view_layer=layer)
        layer.objects.active = copy
        chosen = {name: [copy] for name in ("selected_objects", "selected_editable_objects")}
        yield {"scene": scene, "view_layer": layer, "object": copy, "active_object": copy, **chosen}
    finally:
        bpy.data.scenes.remove(scene)
        bpy.data.batch_remove([data, *dict.fromkeys(materials)])


def _have_read(mesh: bpy.types.Object, image: bpy.types.Image) -> list[str]:
    """Make the gratings of a mesh use a direction map. Returns a line for each that cannot: another mesh shows it."""
    groups = {node.node_tree for slot in mesh.material_slots for node in diffraction_nodes(slot.material)}
    lines = []
    for grating in (grating for scene in bpy.data.scenes for grating in scene.natural_gratings.items):
        if grating.group in groups:
            try:
                choose_frame(grating, replace(grating.frame_source(), kind=FRAME_MAP, frame_map=image))
            except GratingError as error:
                lines.append(f"{grating.name} does not read it: {error}")
    image.use_fake_user = image.users == 0
    return lines
