# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering the scene to a picture."""

from functools import partial
from pathlib import Path

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.base.files import told_of, write_whole
from ..blender import compat, mesa
from ..blender.written import check_picture, rendered_size

_FILE_FORMATS = {".png": "PNG", ".exr": "OPEN_EXR"}


def render_picture(
    path: Path,
    *,
    engine: str | None = None,
    samples: int | None = None,
    width: int | None = None,
    height: int | None = None,
    frame: int | None = None,
) -> None:
    """Render the open scene to a PNG or EXR file, whole or not at all. `engine` is "cycles" or "eevee". None keeps the
    scene's setting. Raises GratingError if the scene has no camera, if the file type is another, or if the picture is
    not written."""
    scene = bpy.context.scene
    if scene.camera is None:
        raise GratingError(f"scene {scene.name}", "no camera", "add one and make it the scene's camera")
    file_format = _FILE_FORMATS.get(path.suffix.lower())
    if file_format is None:
        raise GratingError(path, "neither PNG nor EXR", "name the picture .png or .exr")
    render = scene.render
    if engine:
        render.engine = "CYCLES" if engine == "cycles" else compat.eevee_engine()
    if samples:
        scene.cycles.samples = scene.eevee.taa_render_samples = samples
    render.resolution_x = width or render.resolution_x
    render.resolution_y = height or render.resolution_y
    if width or height:
        render.resolution_percentage = 100
    compat.write_pictures(render.image_settings, file_format)
    if file_format == "OPEN_EXR":
        render.image_settings.color_depth = "32"
    if frame is not None:
        scene.frame_set(frame)
    mesa.filter_as_cards_do()
    with told_of(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path.resolve(), partial(_render_to, render))


def _render_to(render: bpy.types.RenderSettings, path: Path) -> None:
    """Render the open scene to a path. Raises OSError if no whole picture is there afterwards, which Blender does not
    tell."""
    render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    if not path.is_file():
        raise OSError("Blender wrote no picture")
    check_picture(path, rendered_size(render), alpha=render.image_settings.color_mode == "RGBA")
