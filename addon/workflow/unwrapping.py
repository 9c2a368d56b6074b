# SPDX-License-Identifier: GPL-3.0-or-later
"""Unwrapping a mesh into a new UV map. The other maps stay. The grating keeps its former direction, because the new
islands are rotated arbitrarily."""

import hashlib
from pathlib import Path

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from ...precompute.base.progress import Progress, silent
from ...precompute.mesh.unwrap import BY_BLENDER, Mesh, Packing, longest_seconds, write_mesh
from ..direction.uv_maps import has_comb, rendering_map
from ..gratings.direction_source import STORED, UV_MAP
from ..jobs.child import Deadline, Job
from .chosen_meshes import check_not_edited
from .directing import choose_frame, meshes_that_show

NEW_MAP = "Unwrapped"
# Extra seconds for the process to read a mesh and write its map; a million triangles take a few.
_AROUND_SECONDS = 600
# Blender's limit of UV maps on a mesh.
_MAPS_MAX = 8


class Unwrapping:
    """An unwrap by xatlas in a separate process. Poll `job.running`, then call `finish`."""

    def __init__(self, mesh: bpy.types.Object, packing: Packing) -> None:
        """Start the process. Raises GratingError if the mesh cannot be unwrapped."""
        triangles = _triangles(mesh)
        self.mesh_name, self._faces = mesh.name, _faces(mesh.data)
        options = {"--size": packing.size, "--padding": packing.padding, "--density": packing.density}

        def words(private: Path) -> list[str]:
            path = private / "mesh.npz"
            write_mesh(path, triangles)
            return [str(path), *(f"{name}={value}" for name, value in options.items())]

        seconds = longest_seconds(len(triangles.triangles)) + _AROUND_SECONDS
        late = GratingError(mesh.name, f"not unwrapped within {seconds / 60:.0f} min", BY_BLENDER)
        self.job = Job("unwrap", words, deadline=Deadline(seconds, late))

    def finish(self) -> list[str]:
        """Add the new map to the mesh, once the process has ended. Returns lines to report. Raises GratingError, with
        nothing changed, if the process failed, or if the mesh's faces have changed."""
        facts, uv = self.job.result(lambda facts: (facts, _written_map(facts["files"][0])))
        mesh = bpy.data.objects.get(self.mesh_name)
        if mesh is None or mesh.type != "MESH" or mesh.mode == "EDIT" or _faces(mesh.data) != self._faces:
            raise GratingError(self.mesh_name, "its faces changed while it was unwrapped", "unwrap it again")
        return _add_map(mesh, uv, f"{facts['islands']} islands fill {facts['filled']:.0%} of it")


def unwrap_and_wait(mesh: bpy.types.Object, packing: Packing, *, progress: Progress = silent) -> list[str]:
    """Unwrap a mesh by xatlas. Returns lines to report. Raises GratingError, with nothing changed, if that fails."""
    unwrapping = Unwrapping(mesh, packing)
    unwrapping.job.wait(progress)
    return unwrapping.finish()


def unwrap_by_blender(context: bpy.types.Context, mesh: bpy.types.Object, packing: Packing) -> list[str]:
    """Unwrap a mesh by Blender's Minimum Stretch along its seams, or if it has none, along the borders of Smart UV
    Project's islands. Returns lines to report. Raises GratingError, with nothing changed, if that is impossible."""
    count = len(_triangles(mesh).triangles)
    layer = context.view_layer
    chosen, active = list(context.selected_objects), layer.objects.active
    copy = bpy.data.objects.new("Unwrapping", mesh.data.copy())
    data = copy.data
    context.scene.collection.objects.link(copy)
    try:
        for other in chosen:
            other.select_set(False)
        copy.select_set(True)
        layer.objects.active = copy
        own = data.uv_layers.new(name=NEW_MAP)
        own.active, name = True, own.name
        margin = packing.padding / packing.size
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.reveal()
        bpy.ops.mesh.select_all(action="SELECT")
        if not any(edge.use_seam for edge in mesh.data.edges):
            bpy.ops.uv.smart_project(island_margin=margin)
            bpy.ops.uv.seams_from_islands()
        bpy.ops.uv.unwrap(method="MINIMUM_STRETCH", margin_method="FRACTION", margin=margin)
        bpy.ops.object.mode_set(mode="OBJECT")
        uv = np.empty((len(data.loops), 2), np.float32)
        data.uv_layers[name].uv.foreach_get("vector", uv.ravel())
    finally:
        bpy.data.meshes.remove(data)
        for other in chosen:
            other.select_set(True)
        layer.objects.active = active
    return _add_map(mesh, uv[_loops(mesh.data)], f"{count} triangles, by Blender's Minimum Stretch")


def _written_map(path: str) -> np.ndarray:
    with np.load(path) as file:
        return file["uv"]


def _triangles(mesh: bpy.types.Object) -> Mesh:
    """The triangles of a mesh. Raises GratingError if it cannot be unwrapped."""
    data = mesh.data
    if data.library is not None or data.override_library is not None:
        file = (data.library or data.override_library.reference.library).filepath
        raise GratingError(mesh.name, f"its mesh is linked from {file}", "use Object > Relations > Make Local")
    check_not_edited(mesh)
    if not data.polygons:
        raise GratingError(mesh.name, "no faces to unwrap", "choose a mesh with faces")
    if len(data.uv_layers) >= _MAPS_MAX:
        raise GratingError(mesh.name, f"it has {_MAPS_MAX} UV maps, as many as a mesh can have", "remove one")
    points = np.empty((len(data.vertices), 3), np.float32)
    data.vertices.foreach_get("co", points.ravel())
    # In world scale, so that all pixels have one size on the surface even if the object is stretched.
    points = points @ np.array(mesh.matrix_world.to_3x3(), np.float32).T
    data.calc_loop_triangles()
    triangles = np.empty((len(data.loop_triangles), 3), np.int32)
    data.loop_triangles.foreach_get("vertices", triangles.ravel())
    polygons = np.empty(len(triangles), np.int32)
    data.loop_triangles.foreach_get("polygon_index", polygons)
    try:
        return Mesh(points, triangles, polygons)
    except GratingError as error:
        raise GratingError(mesh.name, error.fault, error.remedy) from error


def _loops(data: bpy.types.Mesh) -> np.ndarray:
    """The loop indices (m, 3) of a mesh's triangles."""
    data.calc_loop_triangles()
    loops = np.empty((len(data.loop_triangles), 3), np.int32)
    data.loop_triangles.foreach_get("loops", loops.ravel())
    return loops


def _faces(data: bpy.types.Mesh) -> str:
    """A hash of a mesh's faces, to notice changes."""
    vertices = np.empty(len(data.loops), np.int32)
    data.loops.foreach_get("vertex_index", vertices)
    counts = np.empty(len(data.polygons), np.int32)
    data.polygons.foreach_get("loop_total", counts)
    return hashlib.sha256(vertices.tobytes() + b"/" + counts.tobytes()).hexdigest()


def _add_map(mesh: bpy.types.Object, uv: np.ndarray, facts: str) -> list[str]:
    """Add a UV map to a mesh from the UVs (m, 3, 2) of its triangles' corners. Returns lines to report."""
    data = mesh.data
    before = rendering_map(data).name if data.uv_layers else ""
    corners = np.zeros((len(data.loops), 2), np.float32)
    corners[_loops(data)] = uv
    layer = data.uv_layers.new(name=NEW_MAP, do_init=False)
    layer.uv.foreach_set("vector", corners.ravel())
    layer.active = True
    return [f"{mesh.name}: unwrapped into {layer.name}: {facts}", *_keep_direction(mesh, before)]


def _keep_direction(mesh: bpy.types.Object, before: str) -> list[str]:
    """Set the mesh's gratings to the UV map that rendered before, unless a comb has the direction. Returns lines to
    report."""
    if has_comb(mesh.data):
        return []
    if not before:
        return [f"{mesh.name}: the islands of the new map are rotated, and the colours with them; change the Direction"]
    for grating in (grating for scene in bpy.data.scenes for grating in scene.natural_gratings.items):
        shown_on = meshes_that_show(grating.group)
        if mesh not in shown_on or grating.frame_kind != STORED or any(has_comb(each.data) for each in shown_on):
            continue
        try:
            choose_frame(grating, grating.frame_source()._replace(kind=UV_MAP, uv_map=before))
        except GratingError:
            continue  # another mesh lacks this map; here it still is the map that renders
    return [f"{mesh.name}: its grating keeps the direction of {before}"]
