# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding things that show a grating: a snake, a piece of its shed skin, and a sticker, which is a piece of foil that
lies on a part of a mesh and follows its surface."""

from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...precompute.base.failure import GratingError
from ...precompute.mesh import shapes
from ..blender.objects import add_object, mesh_of_shape, refuse_hidden, select_only
from ..cameras.seen_surfaces import Pixels, seen_from
from ..gratings.grating import active_grating
from ..materials.holograms.hologram_nodes import load_picture
from ..materials.holograms.patterns import PICTURE
from ..materials.material import shown_by
from ..snakes.body import posed_spine, spine_along
from ..snakes.mesh import add_bones, new_mesh, shed_shape
from ..snakes.shape import Detail, snake_shape
from ..snakes.skins import give_skin, new_shed
from .assigning import assign_to_meshes
from .chosen_meshes import check_not_edited
from .making_materials import make_material
from .presets import put_preset
from .varying_inputs import Hologram, add_hologram

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


# The preset of a sticker in a scene without a grating.
FIRST = "security_hologram"
# The cells along each side. Enough to follow a bottle without facets.
_CELLS = 64
# The gap between a sticker and the surface, over its width: too small to see, and large enough that neither engine
# mixes the two surfaces.
_GAP = 0.002
# Below this length on the surface, the picture's right is too near its normal to orient a sticker.
_GRAZING = 0.1


@dataclass(frozen=True)
class Sticker:
    """An artist's choice of a sticker.

    preset    the preset that it is made of; empty for the active grating, or FIRST in a scene without one
    picture   a picture whose hues are the directions of its pattern; empty for the grating's own pattern
    size      its width over that of the target as seen, or less if it would be higher than the target
    rotation  its turn on the surface in radians, counterclockwise"""

    preset: str = ""
    picture: str = ""
    size: float = 0.5
    rotation: float = 0.0


@dataclass(frozen=True)
class _Place:
    """A place on a target: a matrix with the sticker's axes, without scale, and the target's extents along x and y."""

    matrix: Matrix
    extents: tuple[float, float]


def add_sticker(
    context: bpy.types.Context, target: bpy.types.Object, choice: Sticker, *, view: bpy.types.RegionView3D | None = None
) -> list[str]:  # fmt: skip
    """Put a sticker on a mesh, in the middle of what a 3D view shows of it, upright in the view; without a view, or if
    the view looks through the camera, as the camera sees it. It becomes a child of the mesh, and the only selected
    object. Returns lines to report. Raises GratingError, with nothing added, if the mesh is not seen or is in Edit
    Mode, and as seen_from, load_picture, put_preset and assign_to_meshes do."""
    check_not_edited(target)
    refuse_hidden(context)
    depsgraph = context.evaluated_depsgraph_get()
    from_view = view is not None and view.view_perspective != "CAMERA"
    place = _place(target.evaluated_get(depsgraph), seen_from(context.scene, depsgraph, view, from_view=from_view))
    image = load_picture(choice.picture) if choice.picture else None
    sticker = _stuck(context, target, place, choice=choice, aspect=image.size[1] / image.size[0] if image else 1.0)
    try:
        warnings = _covered(context.scene, sticker, choice)
    except BaseException:
        bpy.data.meshes.remove(sticker.data)
        raise
    select_only(context, sticker)
    return [f"{sticker.name}: on {target.name}. Move it with G; it follows the surface", *warnings]


def _place(target: bpy.types.Object, pixels: Pixels) -> _Place:
    """The place in the middle of what a picture shows of an evaluated mesh."""
    box = np.array(target.bound_box)
    window = pixels.window_of([(box, target.matrix_world)])
    unseen = GratingError(target.name, "the view does not show it", "turn the view to it")
    if window is None or not target.data.polygons:
        raise unseen
    middle = (np.array(window.low) + window.high) / 2
    origins, directions = pixels.rays(middle[None])
    world, own = target.matrix_world, target.matrix_world.inverted_safe()
    origin = own @ Vector(origins[0].tolist())
    hit, at, normal, _ = target.ray_cast(origin, own.to_3x3() @ Vector(directions[0].tolist()))
    if not hit:  # the middle of a ring, for instance
        _, at, normal, _ = target.closest_point_on_mesh(origin)
    if not pixels.in_frame(np.array(world @ at)[None])[0]:
        raise unseen
    axes = _upright(np.array(own.to_3x3().transposed() @ normal), directions[0], pixels)
    points = np.empty((len(target.data.vertices), 3), np.float32)
    target.data.vertices.foreach_get("co", points.ravel())
    spans = np.ptp(points @ np.array(world)[:3, :3].T @ axes, axis=0)
    matrix = Matrix.Translation(world @ at) @ Matrix(axes.tolist()).to_4x4()
    return _Place(matrix, (float(spans[0]), float(spans[1])))


def _upright(normal: np.ndarray, ray: np.ndarray, pixels: Pixels) -> np.ndarray:
    """The axes (3, 3), as columns, of a sticker on a surface that a ray meets: z away from the surface towards the
    viewer, x to the right in the picture."""
    z = -np.sign(normal @ ray or -1.0) * normal / np.linalg.norm(normal)
    x = pixels.right - z * (z @ pixels.right)
    if np.linalg.norm(x) < _GRAZING:
        x = np.cross(pixels.up, z)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _stuck(
    context: bpy.types.Context, target: bpy.types.Object, place: _Place, *, choice: Sticker, aspect: float
) -> bpy.types.Object:  # fmt: skip
    """A new sticker at a place, whose height is `aspect` times its width."""
    width = choice.size * min(place.extents[0], place.extents[1] / aspect)
    mesh = mesh_of_shape("Sticker", shapes.flat_sheet(width, width * aspect, cells=_CELLS))
    sticker = add_object(context, mesh)
    wrap = sticker.modifiers.new("Stick", "SHRINKWRAP")
    wrap.target = target
    wrap.wrap_method, wrap.wrap_mode = "PROJECT", "ABOVE_SURFACE"
    wrap.use_project_z = wrap.use_negative_direction = wrap.use_positive_direction = True
    # What the surface turns away from farther than this stays flat, as a stiff foil does.
    wrap.project_limit = width
    wrap.offset = _GAP * width
    sticker.parent = target
    sticker.matrix_parent_inverse = target.matrix_world.inverted_safe()
    sticker.matrix_basis = place.matrix @ Matrix.Rotation(choice.rotation, 4, "Z")
    return sticker


def _covered(scene: bpy.types.Scene, sticker: bpy.types.Object, choice: Sticker) -> list[str]:
    """Give a sticker its material. Returns warnings."""
    preset = choice.preset or (FIRST if scene.natural_gratings.active() is None else "")
    if preset:
        _, *warnings = put_preset(scene, preset, [sticker])
    else:
        _, *warnings = assign_to_meshes(scene, [sticker])
    if not choice.picture:
        return warnings
    grating = active_grating(scene)
    if any(thing != sticker for thing in shown_by(grating.group)):  # the others keep their pattern
        make_material(scene, grating)
        assign_to_meshes(scene, [sticker])
    _, *further = add_hologram(scene, [sticker], Hologram(PICTURE, picture=choice.picture))
    return [*warnings, *further]
