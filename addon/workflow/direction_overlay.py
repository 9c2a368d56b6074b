# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing the direction of the active object's grating in the 3D views. While the overlay is off, it costs no time."""

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
