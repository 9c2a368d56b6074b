# SPDX-License-Identifier: GPL-3.0-or-later
"""The direction of the active object's grating, drawn in the 3D views. While it is off, nothing is called."""

import bpy
import gpu
from bpy.app.handlers import persistent
from gpu_extras.batch import batch_for_shader

from ..scene.frame_source import FrameSource
from .direction_lines import direction_lines

_ARROW, _SEAM = (0.1, 0.9, 1.0, 1.0), (1.0, 0.1, 0.1, 1.0)
_ARROW_WIDTH, _SEAM_WIDTH = 1.5, 3.0


class _Shown:
    """The draw handler while the overlay is on; and the lines drawn last, of the object of a name."""

    handler: object | None = None
    name = ""
    batches: tuple[gpu.types.GPUBatch, ...] = ()


def is_shown() -> bool:
    """Whether the overlay is on."""
    return _Shown.handler is not None


def show(on: bool) -> None:
    """Switch the overlay on or off."""
    if on and not is_shown():
        _Shown.handler = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")
        bpy.app.handlers.depsgraph_update_post.append(_forget)
    elif not on and is_shown():
        bpy.types.SpaceView3D.draw_handler_remove(_Shown.handler, "WINDOW")
        bpy.app.handlers.depsgraph_update_post.remove(_forget)
        _Shown.handler = None
        _forget()


@persistent
def _forget(*_: object) -> None:
    """What was drawn may no longer be true."""
    _Shown.name, _Shown.batches = "", ()


def _draw() -> None:
    context = bpy.context
    thing = context.active_object
    if thing is None or thing.type != "MESH" or thing.mode == "EDIT" or not thing.visible_get():
        return
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    if _Shown.name != thing.name:
        grating = context.scene.natural_gratings.active()
        default = FrameSource() if grating is None else grating.frame_source()
        lines = direction_lines(thing, context.evaluated_depsgraph_get(), default)
        _Shown.name = thing.name
        _Shown.batches = tuple(
            batch_for_shader(shader, "LINES", {"pos": ends.reshape(-1, 3).astype("f")})
            for ends in (lines.arrows, lines.seams)
        )
    gpu.state.depth_test_set("LESS_EQUAL")
    for batch, colour, width in zip(_Shown.batches, (_ARROW, _SEAM), (_ARROW_WIDTH, _SEAM_WIDTH), strict=True):
        gpu.state.line_width_set(width)
        shader.uniform_float("color", colour)
        batch.draw(shader)
    gpu.state.line_width_set(1.0)
    gpu.state.depth_test_set("NONE")
