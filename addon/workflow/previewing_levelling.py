# SPDX-License-Identifier: GPL-3.0-or-later
"""What levelling makes of a grating's scan, as the panel shows it.

Blender draws a panel many times a second, so nothing is computed while it draws. A change of the scan or of its steps
is noticed by what the panel asks for; a timer makes the preview once the artist's hand rests."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import bpy
import bpy.utils.previews

from ...precompute.base.failure import GratingError
from ..blender.changes import STILL
from ..blender.guard import guarded
from ..blender.window import redraw_views
from ..gratings.grating import Grating

if TYPE_CHECKING:
    import numpy as np

    from ...precompute.surface.height_map import HeightMap
    from ...precompute.surface.preview import Preview

# More previews than an artist goes to and fro between; then the memory is given back.
_KEPT_MAX = 32


@dataclass(frozen=True)
class _Asked:
    """All that a preview depends on."""

    scan: tuple[str, float, float, str]
    levelling: str


@dataclass(frozen=True)
class Shown:
    """A preview in the panel.

    icons    of the pictures before and after; 0 for none
    preview  its figures; None where a step failed
    every    each so manyth row and column of the scan is in it
    failure  the reason where a step failed, or the scan could not be read"""

    icons: tuple[int, int] = (0, 0)
    preview: "Preview | None" = None
    every: int = 1
    failure: GratingError | None = None


_shown: dict[_Asked, Shown] = {}
_wanted: list[_Asked] = []
# The scan read last, thinned, and how much.
_scan: dict[tuple[Any, ...], tuple["HeightMap", int]] = {}
_pictures: list[bpy.utils.previews.ImagePreviewCollection] = []


def shown(grating: Grating) -> Shown | None:
    """The preview of a grating; None where it is still to be made, which will be soon."""
    asked = _asked(grating)
    if asked in _shown:
        return _shown[asked]
    if _wanted != [asked]:
        _wanted[:] = [asked]
        if bpy.app.timers.is_registered(refresh):
            bpy.app.timers.unregister(refresh)
        bpy.app.timers.register(refresh, first_interval=STILL)
    return None


@guarded
def refresh() -> None:
    """Make the preview that was asked for last, and draw the panels anew. Blender's timer calls it."""
    for asked in _wanted:
        if len(_shown) >= _KEPT_MAX:
            forget()
        _shown[asked] = _made(asked)
    _wanted.clear()
    redraw_views()


def forget() -> None:
    """Give the memory of all previews back."""
    _shown.clear()
    _scan.clear()
    while _pictures:
        bpy.utils.previews.remove(_pictures.pop())


def stop() -> None:
    """Make no preview any more, and forget all: the extension is being disabled."""
    if bpy.app.timers.is_registered(refresh):
        bpy.app.timers.unregister(refresh)
    _wanted.clear()
    forget()


def scan_of(grating: Grating) -> "HeightMap":
    """A grating's scan, thinned as its preview shows it. Raises GratingError where it cannot be read."""
    return _read(_asked(grating).scan)[0]


def _asked(grating: Grating) -> _Asked:
    scan = (grating.source_file(), grating.size_um, grating.height_nm, grating.channel)
    return _Asked(scan, grating.levelling)


def _read(scan: tuple[str, float, float, str]) -> tuple["HeightMap", int]:
    from ...precompute.surface.preview import thinned
    from ...precompute.surface.readers.reader_registry import read_height_map

    if scan not in _scan:
        source, size_um, height_nm, channel = scan
        whole = read_height_map(source, size_um or None, height_nm or None, channel=channel or None)
        thin = thinned(whole)
        _scan.clear()
        _scan[scan] = thin, round(thin.pixel_size_m[0] / whole.pixel_size_m[0])
    return _scan[scan]


def _made(asked: _Asked) -> Shown:
    from ...precompute.surface.preview import preview
    from ...precompute.surface.steps.pipeline import parse_steps

    try:
        scan, every = _read(asked.scan)
        made = preview(scan, parse_steps(asked.levelling, "Levelling"))
    except GratingError as error:
        return Shown(failure=error)
    return Shown((_icon(made.before.picture), _icon(made.after.picture)), made, every)


def _icon(picture: "np.ndarray") -> int:
    """An icon of a picture (rows, cols, 3) with row 0 on top; Blender's have it at the bottom."""
    import numpy as np

    if not _pictures:
        _pictures.append(bpy.utils.previews.new())
    rows, cols, _ = picture.shape
    # A name of its own, for Blender keeps drawing the picture that it has drawn under a name.
    image = _pictures[0].new(f"levelling {len(_pictures[0])}")
    image.image_size = cols, rows
    opaque = np.dstack([picture[::-1], np.ones((rows, cols))])
    image.image_pixels_float.foreach_set(opaque.astype(np.float32).ravel())
    return image.icon_id
