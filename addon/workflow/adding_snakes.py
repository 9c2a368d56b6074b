# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding a snake, or a piece of its shed skin, to the scene."""

import bpy
import numpy as np
from mathutils import Matrix

from ...precompute.base.failure import GratingError
from ..blender.objects import add_object, refuse_hidden, select_only
from ..snakes.body import posed_spine, spine_along
from ..snakes.mesh import add_bones, new_mesh, shed_shape
from ..snakes.shape import Detail, snake_shape
from ..snakes.skins import give_skin, new_shed

# The pose that follows the active curve.
ALONG_CURVE = "CURVE"


def add_snake(
    context: bpy.types.Context, species: str, pose: str, *, length_m: float, detail: Detail, bones: bool
) -> tuple[bpy.types.Object, list[str]]:  # fmt: skip
    """Add a snake at the 3D cursor, or along the active curve with the curve's length, and select only it.

    `species` is a name in SPECIES, `pose` a name in POSES or ALONG_CURVE. Returns the mesh object and lines to report.
    Raises GratingError, with nothing added, if a value is out of range, or if there is no active curve to follow."""
    if not 0.01 <= length_m <= 100:
        raise GratingError("snake", f"a length of {length_m:g} m", "give 0.01 to 100")
    refuse_hidden(context)
    along_curve = pose == ALONG_CURVE
    spine = spine_along(_curve_points(context)) if along_curve else posed_spine(pose, length_m)
    shape = snake_shape(spine, species, detail)
    mesh = new_mesh("Snake", shape)
    give_skin(mesh, species)
    snake = add_object(context, mesh)
    select_only(context, snake)
    if not along_curve:
        snake.matrix_world = _at_cursor(context)
    if bones:
        add_bones(snake, spine, shape.s)
    return snake, [f"{snake.name}: {len(mesh.polygons):,} faces, {spine.length:.3g} m long"]


def add_shed_skin(
    context: bpy.types.Context, species: str, *, size_m: float, faces: int, seed: int
) -> tuple[bpy.types.Object, list[str]]:  # fmt: skip
    """Add a piece of shed skin at the 3D cursor and select only it. Returns the object and lines to report. Raises
    GratingError, with nothing added, if a value is out of range."""
    if not 1e-4 <= size_m <= 10:
        raise GratingError("shed skin", f"a side of {size_m * 1e3:g} mm", "give 0.1 to 10000")
    refuse_hidden(context)
    mesh = new_mesh("Shed Skin", shed_shape(species, size=size_m, faces=faces, seed=seed))
    mesh.materials.append(new_shed())
    shed = add_object(context, mesh)
    select_only(context, shed)
    shed.matrix_world = _at_cursor(context)
    return shed, [f"{shed.name}: {len(mesh.polygons):,} faces"]


def _at_cursor(context: bpy.types.Context) -> Matrix:
    return Matrix.Translation(context.scene.cursor.location)


def _curve_points(context: bpy.types.Context) -> np.ndarray:
    """The points (n, 3) of the active curve's first spline in world space, in metres."""
    curve = context.active_object
    if curve is None or curve.type != "CURVE":
        name = "no object" if curve is None else curve.name
        raise GratingError(name, "no curve to lay the snake along", "make a curve the active object, or take a pose")
    evaluated = curve.evaluated_get(context.evaluated_depsgraph_get())
    line = evaluated.to_mesh()
    try:
        points: np.ndarray = np.empty(3 * len(line.vertices), np.float32)
        line.vertices.foreach_get("co", points)
        edges: np.ndarray = np.empty(2 * len(line.edges), np.int32)
        line.edges.foreach_get("vertices", edges)
    finally:
        evaluated.to_mesh_clear()
    points, edges = points.reshape(-1, 3).astype(float), edges.reshape(-1, 2)
    # Points of one spline are linked in order. The first missing link is where the next spline begins.
    linked = {(min(pair), max(pair)) for pair in edges.tolist()}
    count = next((k for k in range(1, len(points)) if (k - 1, k) not in linked), len(points))
    matrix = np.array(curve.matrix_world)
    return points[:count] @ matrix[:3, :3].T + matrix[:3, 3]
