# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding a step to a grating's levelling, and the panel's preview of it.

Blender draws a panel many times a second, so nothing is computed during a draw. A draw that finds no preview for the
present scan and steps asks for one, and a timer makes it once the artist pauses."""

from typing import TYPE_CHECKING, Any, NamedTuple

import bpy
import bpy.utils.previews

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded
from ..blender.session import STILL, redraw_views
from ..gratings.grating import Grating

if TYPE_CHECKING:
    import numpy as np

    from ...precompute.surface.height_map import HeightMap
    from ...precompute.surface.preview import Preview

# More previews than an artist switches between. Beyond this, all are discarded.
_KEPT_MAX = 32


class _Asked(NamedTuple):
    """Everything that a preview depends on."""

    scan: tuple[str, float, float, str]
    levelling: str


class Shown(NamedTuple):
    """A preview in the panel.

    icons    icon numbers of the pictures before and after; 0 for none
    preview  its figures; None if a step failed
    every    the preview uses every n-th pixel of the scan along x and y
    failure  why a step failed, or why the scan could not be read"""

    icons: tuple[int, int] = (0, 0)
    preview: "Preview | None" = None
    every: int = 1
    failure: GratingError | None = None


_shown: dict[_Asked, Shown] = {}
_wanted: list[_Asked] = []
# The scan read last, thinned, and the thinning factor.
_scan: dict[tuple[Any, ...], tuple["HeightMap", int]] = {}
_pictures: list[bpy.utils.previews.ImagePreviewCollection] = []


def shown(grating: Grating) -> Shown | None:
    """The preview of a grating, or None if the timer has yet to make it."""
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
    """Make the preview that was asked for last, and redraw the panels. Called by Blender's timer."""
    for asked in _wanted:
        if len(_shown) >= _KEPT_MAX:
            forget()
        _shown[asked] = _made(asked)
    _wanted.clear()
    redraw_views()


def forget() -> None:
    """Discard all previews and free their memory."""
    _shown.clear()
    _scan.clear()
    while _pictures:
        bpy.utils.previews.remove(_pictures.pop())


def stop() -> None:
    """Cancel the timer and discard everything, when the extension is disabled."""
    if bpy.app.timers.is_registered(refresh):
        bpy.app.timers.unregister(refresh)
    _wanted.clear()
    forget()


def scan_of(grating: Grating) -> "HeightMap":
    """A grating's scan, thinned as in its preview. Raises GratingError if it cannot be read."""
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
    """Make an icon from a picture (rows, cols, 3) with row 0 at the top; Blender's icons have row 0 at the bottom."""
    import numpy as np

    if not _pictures:
        _pictures.append(bpy.utils.previews.new())
    rows, cols, _ = picture.shape
    # A new name each time, because Blender keeps drawing the first picture of a name.
    image = _pictures[0].new(f"levelling {len(_pictures[0])}")
    image.image_size = cols, rows
    opaque = np.dstack([picture[::-1], np.ones((rows, cols))])
    image.image_pixels_float.foreach_set(opaque.astype(np.float32).ravel())
    return image.icon_id


def add_step(grating: Grating, name: str) -> None:
    """Add a step of the kind `name` after the active step, with arguments that suit the scan, and make it the active
    one. Raises GratingError if the scan cannot be read, or if a calibration step finds no grating in it."""
    from ...precompute.surface.steps.pipeline import first_step  # enabling does not load it

    step = first_step(name, scan_of(grating))
    at = min(grating.active_step + 1, len(grating.steps))
    grating.steps.add().text = step.text
    grating.steps.move(len(grating.steps) - 1, at)
    grating.active_step = at
