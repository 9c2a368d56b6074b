# SPDX-License-Identifier: GPL-3.0-or-later
"""The direction of the active object's grating, drawn in the 3D views. While it is off, nothing is called."""

import sys
from collections.abc import Callable
from dataclasses import dataclass

import bpy
import gpu
import numpy as np
from bpy.app.handlers import persistent
from gpu_extras.batch import batch_for_shader

from ...precompute.base.failure import printable
from ..blender.guard import guarded
from ..gratings.direction_source import DirectionSource
from .direction_lines import Lines, direction_lines


@dataclass(frozen=True)
class Part:
    """Lines of one kind: their ends (n, 3), single precision, in the scene's space; RGBA; and their width in pixels."""

    ends: np.ndarray
    colour: tuple[float, float, float, float]
    width: float


class _Shown:
    """The draw handler while the overlay is on, and who is told when it fails; and the batches drawn last, each with
    its part, of the object of a name."""

    handler: object | None = None
    on_fault: Callable[[str], None] | None = None
    fault = ""
    name = ""
    batches: tuple[tuple[gpu.types.GPUBatch, Part], ...] = ()


def is_shown() -> bool:
    """Whether the overlay is on."""
    return _Shown.handler is not None


def show(on: bool, on_fault: Callable[[str], None] | None = None) -> None:
    """Switch the overlay on or off. If drawing fails, the overlay switches itself off, and `on_fault` is called once
    with a line that says so."""
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
    """What is drawn of lines: arrows cyan, seams red, singular faces yellow. A kind without a line has no part, as no
    batch can be made of nothing."""
    kinds = (
        (lines.arrows, (0.1, 0.9, 1.0, 1.0), 1.5),
        (lines.seams, (1.0, 0.1, 0.1, 1.0), 3.0),
        (lines.singular, (1.0, 0.85, 0.1, 1.0), 3.0),
    )
    return [Part(ends.reshape(-1, 3).astype("f"), colour, width) for ends, colour, width in kinds if len(ends)]


@persistent
@guarded
def _forget(*_: object) -> None:
    """What was drawn may no longer be true."""
    _Shown.name, _Shown.batches = "", ()


def _draw() -> None:
    """The draw handler. It never raises: Blender would print the traceback at every redraw."""
    if _Shown.fault:
        return
    try:
        _draw_lines()
    except Exception as error:
        told = printable(f"{type(error).__name__}: {error}")
        _Shown.fault = f"Show Direction was switched off: drawing failed ({told}); report this line"
        # Not from within: Blender is going through its draw handlers.
        bpy.app.timers.register(_switch_off)


@guarded
def _switch_off() -> None:
    """Take the overlay away after a fault, and say so."""
    if not _Shown.fault:  # it was switched off and on meanwhile
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
