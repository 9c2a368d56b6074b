# SPDX-License-Identifier: GPL-3.0-or-later
"""Choosing where a grating takes its direction from, and drawing that direction in the 3D views: for each material slot
of the active object, with Rotation included. While the overlay is off, it costs no time."""

import sys
from collections.abc import Callable
from dataclasses import dataclass

import bpy
import gpu
import numpy as np
from bpy.app.handlers import persistent
from gpu_extras.batch import batch_for_shader

from ...precompute.base.failure import GratingError, printable
from ..blender.guard import guarded
from ..direction.combed_mesh import singular_faces
from ..direction.lines import arrows, rings, seam_lines
from ..direction.tangents import own_angle
from ..gratings.direction_source import FRAME_MAP, STORED, UV_MAP, DirectionSource, is_frame_map
from ..gratings.grating import Grating
from ..materials.group_properties import frame_of
from ..materials.material import diffraction_nodes, linked_among, number_in, shown_by
from ..materials.skin import set_up
from .chosen_meshes import check_frame


def choose_frame(grating: Grating, source: DirectionSource) -> str:
    """Make all materials of a grating take their direction from a source. Returns a line to report. Raises
    GratingError, with nothing changed, if the source or a mesh that shows the grating lacks what is needed, or if the
    grating's node group is linked from another file."""
    if source.kind == UV_MAP and not source.uv_map:
        raise GratingError(grating.name, "no UV map is named for its direction", "name one")
    if source.kind == FRAME_MAP and not is_frame_map(source.frame_map):
        name = "no picture" if source.frame_map is None else source.frame_map.name
        raise GratingError(grating.name, f"{name} is no direction map", "use Bake Direction Map")
    group = grating.group
    if group is not None and group.library is not None:
        raise GratingError(group.name, f"linked from {group.library.filepath}", "make it local to change its direction")
    for mesh in meshes_that_show(group):
        check_frame(mesh, source)
    grating.take_frame_source(source)
    if group is not None:
        set_up(group, frame=source)
    return f"{grating.name}: its direction is from {described(source)}"


def described(source: DirectionSource) -> str:
    """A source in a few words."""
    return {
        "STORED": "what is stored on the mesh, else its UV map",
        "UV_MAP": f"the UV map {source.uv_map}",
        "RADIAL": f"away from the object's {source.axis} axis",
        "AXIS": f"the object's {source.axis} axis",
        "FRAME_MAP": f"the direction map {source.frame_map.name if source.frame_map else ''}",
    }[source.kind]


def meshes_that_show(group: bpy.types.NodeTree | None) -> list[bpy.types.Object]:
    """The file's mesh objects that have a Diffraction group in their materials."""
    return [thing for thing in shown_by(group) if thing.type == "MESH"]


# More arrows are slower and no clearer.
_ARROWS_MAX = 5000


@dataclass(frozen=True)
class Lines:
    """Ends (n, 2, 3) of lines in world space: arrows along T, seams where T jumps, rings around a comb's singular
    faces."""

    arrows: np.ndarray
    seams: np.ndarray
    singular: np.ndarray


def direction_lines(thing: bpy.types.Object, depsgraph: bpy.types.Depsgraph, default: DirectionSource) -> Lines:
    """The lines of an evaluated mesh object. Slots without diffraction use `default`. A linked Rotation is ignored."""
    evaluated = thing.evaluated_get(depsgraph)
    mesh = evaluated.data
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    chosen = np.unique(np.linspace(0, count - 1, min(count, _ARROWS_MAX)).astype(int)) if count else np.empty(0, int)
    polygons, slots = np.empty(count, np.int32), np.empty(len(mesh.polygons), np.int32)
    mesh.loop_triangles.foreach_get("polygon_index", polygons)
    mesh.polygons.foreach_get("material_index", slots)
    frames = [_frame(thing, slot, default) for slot in thing.material_slots] or [(default, own_angle(thing, default))]
    numbers = np.minimum(slots[polygons[chosen]], len(frames) - 1)
    parts = [
        arrows(mesh, chosen[numbers == number], source=source, angle=angle)
        for number, (source, angle) in enumerate(frames)
    ]
    sources = dict.fromkeys(source for source, _ in frames)
    seams = [seam_lines(mesh, source) for source in sources]
    marks = [rings(mesh, singular_faces(mesh), among=len(chosen))] if any(s.kind == STORED for s in sources) else []
    world = np.array(evaluated.matrix_world)
    ends = (np.concatenate([*lines, np.empty((0, 2, 3))]) for lines in (parts, seams, marks))
    return Lines(*(each @ world[:3, :3].T + world[:3, 3] for each in ends))


def _frame(
    thing: bpy.types.Object, slot: bpy.types.MaterialSlot, default: DirectionSource
) -> tuple[DirectionSource, float]:
    """A slot's direction source, and the angle (radians) by which the material and the object turn it."""
    nodes = diffraction_nodes(slot.material)
    if not nodes:
        return default, own_angle(thing, default)
    node = nodes[0]
    source = frame_of(node.node_tree)
    return source, own_angle(thing, source) + (0.0 if linked_among(node, ["Rotation"]) else number_in(node, "Rotation"))


@dataclass(frozen=True)
class Part:
    """Lines of one kind: end points (n, 3) in world space in single precision, colour (RGBA), and width in pixels."""

    ends: np.ndarray
    colour: tuple[float, float, float, float]
    width: float


class _Shown:
    """State of the overlay: draw handler, callback and line of a fault, and the last batches with their object's
    name."""

    handler: object | None = None
    on_fault: Callable[[str], None] | None = None
    fault = ""
    name = ""
    batches: tuple[tuple[gpu.types.GPUBatch, Part], ...] = ()


def is_shown() -> bool:
    """Whether the overlay is on."""
    return _Shown.handler is not None


def show(on: bool, on_fault: Callable[[str], None] | None = None) -> None:
    """Switch the overlay on or off. If drawing fails, it switches itself off and calls `on_fault` once with a line."""
    if on and not is_shown():
        _Shown.on_fault, _Shown.fault = on_fault, ""
        _Shown.handler = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")
        bpy.app.handlers.depsgraph_update_post.append(_forget)
    elif not on and is_shown():
        bpy.types.SpaceView3D.draw_handler_remove(_Shown.handler, "WINDOW")
        bpy.app.handlers.depsgraph_update_post.remove(_forget)
        _Shown.handler = None
        _forget()


def parts_of(lines: Lines) -> list[Part]:
    """Lines by colour: arrows cyan, seams red, singular faces yellow. Empty kinds are left out: a batch must not be
    empty."""
    kinds = (
        (lines.arrows, (0.1, 0.9, 1.0, 1.0), 1.5),
        (lines.seams, (1.0, 0.1, 0.1, 1.0), 3.0),
        (lines.singular, (1.0, 0.85, 0.1, 1.0), 3.0),
    )
    return [Part(ends.reshape(-1, 3).astype("f"), colour, width) for ends, colour, width in kinds if len(ends)]


@persistent
@guarded
def _forget(*_: object) -> None:
    """Discard the batches after any change of the scene."""
    _Shown.name, _Shown.batches = "", ()


def _draw() -> None:
    """The draw handler. It never raises, because Blender would print the traceback at every redraw."""
    if _Shown.fault:
        return
    try:
        _draw_lines()
    except Exception as error:
        told = printable(f"{type(error).__name__}: {error}")
        _Shown.fault = f"Show Direction was switched off: drawing failed ({told}); report this line"
        # A timer, because Blender is iterating over its draw handlers now.
        bpy.app.timers.register(_switch_off)


@guarded
def _switch_off() -> None:
    """Switch the overlay off after a fault, and report it."""
    if not _Shown.fault:  # the overlay was switched off and on meanwhile
        return
    print(f"error: {_Shown.fault}", file=sys.stderr)
    show(False)
    if _Shown.on_fault is not None:
        _Shown.on_fault(_Shown.fault)


def _draw_lines() -> None:
    context = bpy.context
    thing = context.active_object
    if thing is None or thing.type != "MESH" or thing.mode == "EDIT" or not thing.visible_get():
        return
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    if _Shown.name != thing.name:
        grating = context.scene.natural_gratings.active()
        default = DirectionSource() if grating is None else grating.frame_source()
        parts = parts_of(direction_lines(thing, context.evaluated_depsgraph_get(), default))
        _Shown.batches = tuple((batch_for_shader(shader, "LINES", {"pos": part.ends}), part) for part in parts)  # type: ignore[dict-item]  # an array is a buffer
        _Shown.name = thing.name
    try:
        gpu.state.depth_test_set("LESS_EQUAL")
        for batch, part in _Shown.batches:
            gpu.state.line_width_set(part.width)
            shader.uniform_float("color", part.colour)
            batch.draw(shader)
    finally:
        gpu.state.line_width_set(1.0)
        gpu.state.depth_test_set("NONE")
