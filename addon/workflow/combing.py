# SPDX-License-Identifier: GPL-3.0-or-later
"""Combing the selected meshes in a separate process: a smooth direction is laid over each and stored on it."""

from pathlib import Path

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from ...precompute.base.progress import Progress, silent
from ...precompute.mesh.mesh_files import read_combed, write_mesh
from ..direction import combed_mesh, drawn_lines
from ..direction.uv_maps import has_comb, rendering_map
from ..gratings.direction_source import COMB_SOURCES, COMB_UV
from ..jobs.child import Deadline, Job
from .chosen_meshes import check_can_change, check_not_edited, data_is_fixed, no_mesh
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
        "STROKES": lambda: drawn_lines.strokes(scene, objects),
        "HAIR": lambda: drawn_lines.hairs(thing, objects),
        "BONES": lambda: drawn_lines.bones(thing, objects),
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
