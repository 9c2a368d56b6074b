# SPDX-License-Identifier: GPL-3.0-or-later
"""Combing the selected meshes in a separate process, where a smooth direction is laid over each and stored on it; and
baking the direction of a mesh's grating into a direction map (direction/tangent_frame.py).

Cycles bakes a copy of the mesh, in a separate scene, with the material's own direction nodes. So the map is exact at
pixel centres, and the artist's scene stays unchanged."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from ...precompute.base.files import told_of, write_whole
from ...precompute.base.progress import Progress, silent
from ...precompute.mesh.mesh_files import read_combed, write_mesh
from ..blender.written import check_picture, fault_of, written_by_blender
from ..direction import combed_mesh, lines
from ..direction.tangent_frame import baking_material, new_map, note_mesh
from ..direction.uv_maps import has_comb, has_uv_map, rendering_map
from ..gratings.direction_source import COMB_SOURCES, COMB_UV, FRAME_MAP, DirectionSource
from ..jobs.child import Deadline, Job
from ..materials.group_properties import frame_of
from ..materials.material import diffraction_nodes
from .chosen_meshes import check_can_change, check_not_edited, data_is_fixed, no_mesh
from .directing import choose_frame
from .making_materials import read_combs

# Time limit in seconds: a base, and a part for each face corner. It is 100 times the slowest comb of a million
# triangles, 28 s on two cores (docs/direction.md).
_LONGEST_SECONDS, _SECONDS_PER_CORNER = 600, 100 * 28e-6
# Blender's limit of UV maps on a mesh.
_MAPS_MAX = 8


class CombJob(Job):
    """The process that combs some meshes. `meshes` are pairs of names, the object's and its mesh's."""

    def __init__(self, requests: dict[tuple[str, str], dict[str, np.ndarray]], label: str) -> None:
        """Start the process. Raises GratingError if a file cannot be written."""
        self.meshes, self.label = list(requests), label

        def words(private: Path) -> list[str]:
            files = [private / f"{number}.npz" for number in range(len(requests))]
            for file, ((_, mesh), request) in zip(files, requests.items(), strict=True):
                write_mesh(file, combed_mesh.polygons_of(bpy.data.meshes[mesh]), request)
            return [str(file) for file in files]

        named = ", ".join(thing for thing, _ in self.meshes)
        corners = sum(len(bpy.data.meshes[mesh].loops) for _, mesh in self.meshes)
        seconds = _LONGEST_SECONDS + _SECONDS_PER_CORNER * corners
        late = GratingError(named, f"not combed within {seconds / 60:.0f} min", "comb a mesh of fewer faces")
        super().__init__("comb", words, deadline=Deadline(seconds, late))

    def fields(self) -> list[dict[str, np.ndarray]]:
        """The combed meshes, once the process has ended. Raises GratingError if it failed."""
        return self.result(lambda facts: [read_combed(Path(each["file"])) for each in facts["meshes"]])


def start_comb(scene: bpy.types.Scene, objects: list[bpy.types.Object], source: str) -> CombJob:
    """Start combing the meshes among the objects by one of COMB_SOURCES. The other objects may be strokes, hair or
    bones. Raises GratingError, with nothing changed, if a mesh cannot be combed, or has nothing of the source to
    follow."""
    meshes = {o.data: o for o in objects if o.type == "MESH"}
    if not meshes:
        raise no_mesh(scene, objects)
    for thing in meshes.values():
        _check(thing)
    requests = {
        (thing.name, mesh.name): {"name": np.array(thing.name), **_request(scene, thing, objects, source=source)}
        for mesh, thing in meshes.items()
    }
    return CombJob(requests, next(label for name, label, _ in COMB_SOURCES if name == source))


def finish_comb(job: CombJob) -> list[str]:
    """Store the result of a job on its meshes. Returns a line for each mesh. Raises GratingError, with nothing changed,
    if the job failed or a mesh has changed meanwhile."""
    fields = job.fields()
    meshes: list[bpy.types.Mesh] = []
    for (thing, name), field in zip(job.meshes, fields, strict=True):
        mesh = bpy.data.meshes.get(name)
        if mesh is None or mesh.is_editmode or len(mesh.loops) != len(field["uv"]):
            raise GratingError(thing, "changed while it was combed", "comb it again, in Object Mode")
        meshes.append(mesh)
    report = []
    for (thing, _), mesh, field in zip(job.meshes, meshes, fields, strict=True):
        combed_mesh.store(mesh, field["uv"], field["turn"])
        combed_mesh.note_singular(mesh, field["triangle"])
        report.append(f"{thing}: combed by {job.label}; {_told(field['index'])}")
    read_combs()
    return report


def comb_and_wait(
    scene: bpy.types.Scene, objects: list[bpy.types.Object], source: str, *, progress: Progress = silent
) -> list[str]:
    """Comb the meshes among the objects. Returns a line for each. Raises GratingError as finish_comb does."""
    job = start_comb(scene, objects, source)
    job.wait(progress)
    return finish_comb(job)


def _check(thing: bpy.types.Object) -> None:
    """Raise GratingError unless a comb can be stored on the object's mesh."""
    check_can_change(thing)
    mesh = thing.data
    if data_is_fixed(thing):
        raise GratingError(thing.name, f"its mesh {mesh.name} is linked from another file", "make it local to comb it")
    check_not_edited(thing)
    if not mesh.polygons:
        raise GratingError(thing.name, "no faces to comb", "choose a mesh with faces")
    if COMB_UV in mesh.uv_layers and not has_comb(mesh):
        raise GratingError(
            thing.name, f"has a UV map {COMB_UV} of its own", "rename it, because a comb takes this name"
        )
    if COMB_UV not in mesh.uv_layers and len(mesh.uv_layers) >= _MAPS_MAX:
        raise GratingError(thing.name, f"has {_MAPS_MAX} UV maps, and a comb needs one more", "remove one")


def _request(
    scene: bpy.types.Scene, thing: bpy.types.Object, objects: list[bpy.types.Object], *, source: str
) -> dict[str, np.ndarray]:
    """The comb's source as arrays for the process. Raises GratingError if there is nothing to follow."""
    if source in ("X", "Y", "Z"):
        return {"guide": np.array("axis"), "axis": np.array([float(axis == source) for axis in "XYZ"])}
    if source in ("UV", "COPY"):
        return {"guide": np.array(source.lower()), "uv": combed_mesh.uv_of(_own_map(thing))}
    if source in ("TAIL", "SMOOTHEST"):
        return {"guide": np.array(source.lower())}
    found = {
        "STROKES": lambda: lines.strokes(scene, objects),
        "HAIR": lambda: lines.hairs(thing, objects),
        "BONES": lambda: lines.bones(thing, objects),
    }[source]()
    if not found:
        fault, remedy = {
            "STROKES": ("no strokes", "draw with the Annotate tool on its surface, or select a curve with it"),
            "HAIR": ("no hair", "select hair curves with it"),
            "BONES": ("no bones", "select an armature with it, or give it an Armature modifier"),
        }[source]
        raise GratingError(thing.name, fault, remedy)
    inwards = np.array(thing.matrix_world.inverted_safe())
    segments = np.concatenate(found) @ inwards[:3, :3].T + inwards[:3, 3]
    return {"guide": np.array("bones" if source == "BONES" else "strokes"), "segments": segments}


def _own_map(thing: bpy.types.Object) -> bpy.types.MeshUVLoopLayer:
    """The UV map that renders, or if that is the comb's, the first other one. Raises GratingError if there is none."""
    others = [each for each in thing.data.uv_layers if each.name != COMB_UV]
    if not others:
        raise GratingError(thing.name, "no UV map to comb along", "unwrap it, or choose another source")
    renders = rendering_map(thing.data)
    return renders if renders.name != COMB_UV else others[0]


def _told(index: np.ndarray) -> str:
    """Describe the singular triangles of a direction field by their indices (s,). Index 0 is a flip."""
    points, flips = int((index != 0).sum()), int((index == 0).sum())
    told = f"{points} singular point{'s' * (points != 1)}" if points else "no singular points"
    if flips:
        told += f", {flips} faces where the source has no clear direction"
    return told + ("; Show Direction rings them, and they are selected in Edit Mode" if points or flips else "")


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
        fault = f"Cycles cannot bake its direction map ({fault_of(error)})"
        raise GratingError(mesh.name, fault, "enable Cycles") from error
    except BaseException:
        bpy.data.images.remove(image)
        raise
    image.use_fake_user = not read
    done = f"{image.name}: the direction on {mesh.name}, {size} x {size} pixels on its UV map {layer.name}"
    return [done, *(_have_read(mesh, image) if read else [])]


def write_map(image: bpy.types.Image, path: Path) -> None:
    """Write a picture to a file of its own kind, whole or not at all. Raises GratingError."""

    def write(partial: Path) -> None:
        with written_by_blender():
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
                choose_frame(grating, grating.frame_source()._replace(kind=FRAME_MAP, frame_map=image))
            except GratingError as error:
                lines.append(f"{grating.name} does not read it: {error}")
    image.use_fake_user = image.users == 0
    return lines
