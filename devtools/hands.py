# SPDX-License-Identifier: GPL-3.0-or-later
"""Mouse and keyboard events in a Blender with a window and --enable-event-simulate, as steps of a story.

Steps are generators; each yields the seconds that Blender has until the next. play() runs them by Blender's timer.
Where a button lies is found as a person finds it, by looking under the pointer: Ctrl-C over a button copies what it
does.
"""

import os
import struct
import sys
import traceback
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy_extras.view3d_utils import location_3d_to_region_2d

if TYPE_CHECKING:
    from PIL import Image

# Seconds that Blender has for an event, and for one that builds a node group.
MOMENT, LONG = 0.05, 1.0
_ROW = 14  # pixels; a button is 20 high

# By the button's command: the row where it was found last.
_rows: dict[str, int] = {}

Steps = Iterator[float]


def window() -> bpy.types.Window:
    """Blender's first window."""
    return bpy.context.window_manager.windows[0]


def view() -> tuple[bpy.types.Area, bpy.types.Region, bpy.types.Region]:
    """The 3D view, its window region and its sidebar."""
    area = next(a for a in window().screen.areas if a.type == "VIEW_3D")
    regions = {region.type: region for region in area.regions}
    return area, regions["WINDOW"], regions["UI"]


def move(x: float, y: float) -> None:
    """The pointer goes there."""
    window().event_simulate("MOUSEMOVE", "NOTHING", x=int(x), y=int(y))


def click(x: float, y: float) -> Steps:
    """The pointer goes there, then the button goes down and up."""
    move(x, y)
    yield MOMENT
    for value in ("PRESS", "RELEASE"):
        window().event_simulate("LEFTMOUSE", value, x=int(x), y=int(y))
        yield MOMENT


def press_key(key: str, x: float, y: float, **modifiers: bool) -> Steps:
    """A key goes down and up, with the pointer there."""
    for value in ("PRESS", "RELEASE"):
        window().event_simulate(key, value, x=int(x), y=int(y), **modifiers)
        yield MOMENT


def find_button(command: str, across: float = 0.3) -> Generator[float, None, tuple[float, float]]:
    """Looks for the button that runs a command, so far across the sidebar; returns where it lies."""
    sidebar = view()[2]
    x = sidebar.x + sidebar.width * across
    # The panel's height changes little: near where the button was last time.
    rows = range(sidebar.y + sidebar.height - _ROW, sidebar.y, -_ROW)
    known = _rows.get(command, rows[0])
    for y in sorted(rows, key=lambda row: abs(row - known)):
        bpy.context.window_manager.clipboard = ""
        move(x, y)
        yield MOMENT
        yield from press_key("C", x, y, ctrl=True)
        if bpy.context.window_manager.clipboard.startswith(command):
            _rows[command] = y
            return x, y
    raise AssertionError(f"no button in the sidebar runs {command}")


def press_button(command: str, across: float = 0.3) -> Steps:
    """Finds the button that runs the command, so far across the sidebar, and clicks it."""
    x, y = yield from find_button(command, across)
    yield from click(x, y)
    yield LONG


def press_in_view(key: str, **modifiers: bool) -> Steps:
    """Presses a key over the 3D view."""
    region = view()[1]
    x, y = region.x + region.width / 4, region.y + region.height / 2
    move(x, y)
    yield MOMENT
    yield from press_key(key, x, y, **modifiers)
    yield LONG


def click_object(name: str, at: tuple[float, float, float]) -> Steps:
    """Clicks the object in the 3D view, at a place of the world on it."""
    area, region, _ = view()
    place = location_3d_to_region_2d(region, area.spaces.active.region_3d, at)
    yield from click(region.x + place.x, region.y + place.y)
    selected = [o.name for o in bpy.context.view_layer.objects if o.select_get()]
    assert selected == [name], f"clicked {name}, selected {selected}"


def show_sidebar() -> Steps:
    """The camera's view, and the extension's tab of the sidebar."""
    area, _, sidebar = view()
    area.spaces.active.show_region_ui = True
    area.spaces.active.region_3d.view_perspective = "CAMERA"
    yield LONG
    sidebar.active_panel_category = "Grating"
    area.tag_redraw()
    yield LONG


def screen_picture(screen: Path) -> "Image.Image":
    """The screen, from the file that holds its picture (display.py). Blender's own screenshot is black without a
    graphics card's front buffer."""
    from PIL import Image

    held = screen.read_bytes()
    # The fields of an xwd header, 32 bits each, that say where the pixels begin, and how they are laid out.
    header_size, _, _, _, width, height, *rest = struct.unpack(">25I", held[:100])
    row_bytes, colours = rest[6], rest[13]
    return Image.frombytes("RGB", (width, height), held[header_size + 12 * colours :], "raw", "BGRX", row_bytes)


def play(story: Steps) -> None:
    """Plays a story by Blender's timer and quits; what went wrong is in the exit status and the output."""
    bpy.app.timers.register(lambda: _next(story), first_interval=1.0, persistent=True)


def _next(story: Steps) -> float:
    try:
        return next(story)
    except StopIteration:
        os._exit(0)
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
