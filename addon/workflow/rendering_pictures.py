# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering the scene to a picture, and pictures of a grating in Blender's Image Editor: its heights, its spectrum, and
the chart of its colours."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import bpy
import numpy as np

from ...precompute.bake.request import Scan
from ...precompute.base.failure import GratingError, printable
from ...precompute.base.files import told_of, write_whole
from ...precompute.maps.brdf_map import view_chart
from ...precompute.maps.pictures import height_picture, spectrum_picture
from ...precompute.surface.height_map import HeightMap
from ...precompute.surface.steps.pipeline import level, parse_steps
from ...precompute.table import atlas
from ..blender import compat, mesa
from ..blender.written import check_picture, rendered_size
from ..gratings.grating import Grating
from .finding_bakes import bake_of

HEIGHT, SPECTRUM, CHART = "HEIGHT", "SPECTRUM", "CHART"
_TITLES = {HEIGHT: "Height Map", SPECTRUM: "Spectrum", CHART: "Chart"}
# The custom property that marks a picture with its kind, so that the next one of the kind takes its place.
_MARK = "ng_picture"


def show_picture(grating: Grating, kind: str, light_deg: float) -> list[str]:
    """Draw a picture of a grating, and show it in an Image Editor; without one, in a new window. Returns a line to
    report. Raises GratingError, with no picture changed, if the scan or the bake cannot be read."""
    pixels = _DRAWN[kind](grating, light_deg)
    image = _image(kind)
    image.name = f"{_TITLES[kind]} of {printable(grating.name)}"
    _fill(image, pixels)
    of_first = " (its first scan)" if kind != CHART and grating.further_scans() else ""
    place = "in the Image Editor" if _show(image) else "open it in an Image Editor"
    return [f"{image.name}{of_first}: {place}"]


def _height(grating: Grating, _: float) -> np.ndarray:
    return height_picture(_levelled(grating))


def _spectrum(grating: Grating, _: float) -> np.ndarray:
    return spectrum_picture(_levelled(grating))


def _chart(grating: Grating, light_deg: float) -> np.ndarray:
    table, _ = atlas.read(bake_of(grating))
    return view_chart(table, light_deg)


_DRAWN: dict[str, Callable[[Grating, float], np.ndarray]] = {HEIGHT: _height, SPECTRUM: _spectrum, CHART: _chart}


def _levelled(grating: Grating) -> HeightMap:
    """The grating's own scan after its steps, all pixels of it."""
    steps = parse_steps(grating.levelling, f"{grating.name}: Levelling")
    return level(Scan(**grating.scan()).read(), steps).height_map


def _image(kind: str) -> bpy.types.Image:
    """The file's image of a kind of picture, made if there is none."""
    for image in bpy.data.images:
        if image.library is None and image.get(_MARK) == kind:
            return image
    image = bpy.data.images.new(_TITLES[kind], 1, 1)
    image[_MARK] = kind
    return image


def _fill(image: bpy.types.Image, pixels: np.ndarray) -> None:
    """Set an image's pixels (rows, cols, 3) of 8 bits, row 0 on top, and pack it, so that Blender does not ask to save
    it. Without a user it leaves the file when the file is saved."""
    rows, cols, _ = pixels.shape
    if tuple(image.size) != (cols, rows):
        image.scale(cols, rows)
    values = np.ones((rows, cols, 4), np.float32)
    values[..., :3] = pixels[::-1] / np.float32(255)
    image.pixels.foreach_set(values.ravel())
    image.update()
    image.pack()


def _show(image: bpy.types.Image) -> bool:
    """Show an image in the first Image Editor of the open windows, or in a new window. Returns whether it is shown."""
    editors = [
        area
        for window in bpy.context.window_manager.windows
        for area in window.screen.areas
        if area.ui_type == "IMAGE_EDITOR"
    ]
    if not editors and not bpy.app.background:
        editors = _new_editor()
    for area in editors[:1]:
        area.spaces.active.image = image  # type: ignore[attr-defined]  # the space of an Image Editor
        area.tag_redraw()
    return bool(editors)


def _new_editor() -> list[bpy.types.Area]:
    """Open a window with one Image Editor; none if Blender cannot open a window."""
    try:
        bpy.ops.wm.window_new()
    except RuntimeError:
        return []
    area = bpy.context.window_manager.windows[-1].screen.areas[0]
    area.ui_type = "IMAGE_EDITOR"
    return [area]


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
