# SPDX-License-Identifier: GPL-3.0-or-later
"""Mouse and keyboard events for a Blender with a window and --enable-event-simulate, as steps of a story.

Steps are generators. Each yields the seconds that Blender gets before the next; play() runs them by Blender's timer. A
button is found as a person finds it, by trying under the pointer: Ctrl-C over a button copies its command."""

import importlib
import os
import struct
import sys
import traceback
import zlib
from collections.abc import Generator, Iterator
from pathlib import Path
from types import ModuleType

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d

_ADDON = "bl_ext.user_default.natural_gratings.addon"
# Seconds for an event, and for an event that builds a node group.
MOMENT, LONG = 0.05, 1.0
_ROW = 14  # pixels; a button is 20 high
_SHADOW = 7  # pixels; a popup's, to the left, to the right and below
_TABS = 60  # pixels; the width of the sidebar's tabs, at most

# The row where each button was found last, by its command.
_rows: dict[str, int] = {}
# The lines of walk.md so far.
_lines: list[str] = []

Steps = Iterator[float]


def part(name: str) -> ModuleType:
    """A module of the extension's add-on."""
    return importlib.import_module(f"{_ADDON}.{name}")


def look_installed() -> None:
    """Let the panel look as in a Blender from blender.org with the zip: with all packages, and with the manual."""
    part("ui.installation").missing_line = str
    part("ui.installation").MANUAL = Path(__file__)


def window() -> bpy.types.Window:
    """Blender's first window."""
    return bpy.context.window_manager.windows[0]


def view() -> tuple[bpy.types.Area, bpy.types.Region, bpy.types.Region]:
    """The 3D view, its window region and its sidebar."""
    area = next(a for a in window().screen.areas if a.type == "VIEW_3D")
    regions = {region.type: region for region in area.regions}
    return area, regions["WINDOW"], regions["UI"]


def move(x: float, y: float) -> None:
    """Move the pointer."""
    window().event_simulate("MOUSEMOVE", "NOTHING", x=int(x), y=int(y))


def click(x: float, y: float) -> Steps:
    """Move the pointer and click."""
    move(x, y)
    yield MOMENT
    for value in ("PRESS", "RELEASE"):
        window().event_simulate("LEFTMOUSE", value, x=int(x), y=int(y))
        yield MOMENT


def press_key(key: str, x: float, y: float, **modifiers: bool) -> Steps:
    """Press and release a key at the pointer's position."""
    for value in ("PRESS", "RELEASE"):
        window().event_simulate(key, value, x=int(x), y=int(y), **modifiers)
        yield MOMENT


def find_button(command: str, across: float = 0.3) -> Generator[float, None, tuple[float, float]]:
    """Find the button that runs a command and return its position. The command's beginning will do, and a part of its
    arguments after "...". `across` is the share of the sidebar's width."""
    beginning, _, argument = command.partition("...")
    sidebar = view()[2]
    x = sidebar.x + sidebar.width * across
    # The panel's height changes little, so the search starts where the button was last time.
    rows = range(sidebar.y + sidebar.height - _ROW, sidebar.y, -_ROW)
    known = _rows.get(command, rows[0])
    for y in sorted(rows, key=lambda row: abs(row - known)):
        bpy.context.window_manager.clipboard = ""
        move(x, y)
        yield MOMENT
        yield from press_key("C", x, y, ctrl=True)
        copied = bpy.context.window_manager.clipboard
        if copied.startswith(beginning) and argument in copied:
            _rows[command] = y
            return x, y
    raise AssertionError(f"no button in the sidebar runs {command}")


def press_button(command: str, across: float = 0.3) -> Steps:
    """Find the button that runs a command, and click it. `across` is as in find_button."""
    x, y = yield from find_button(command, across)
    yield from click(x, y)
    yield LONG


def press_in_view(key: str, **modifiers: bool) -> Steps:
    """Press a key over the 3D view."""
    region = view()[1]
    x, y = region.x + region.width / 4, region.y + region.height / 2
    move(x, y)
    yield MOMENT
    yield from press_key(key, x, y, **modifiers)
    yield LONG


def file_dialog() -> tuple[bpy.types.Window, bpy.types.Area]:
    """The file dialog that is open, and its window: Blender's preferences say whether it has one of its own."""
    windows = bpy.context.window_manager.windows
    return next((each, area) for each in windows for area in each.screen.areas if area.type == "FILE_BROWSER")


def choose_file(folder: Path, name: str) -> Steps:
    """Choose a file in the file dialog that is open, and confirm it."""
    owner, browser = file_dialog()
    parameters = browser.spaces.active.params
    parameters.directory, parameters.filename = str(folder).encode(), name
    yield LONG
    region = next(region for region in browser.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=owner, area=browser, region=region):
        bpy.ops.file.execute("INVOKE_DEFAULT")
    yield LONG


def click_object(name: str, at: tuple[float, float, float]) -> Steps:
    """Click an object in the 3D view, at the world position `at`."""
    area, region, _ = view()
    place = location_3d_to_region_2d(region, area.spaces.active.region_3d, at)
    yield from click(region.x + place.x, region.y + place.y)
    selected = [o.name for o in bpy.context.view_layer.objects if o.select_get()]
    assert selected == [name], f"clicked {name}, selected {selected}"


def show_sidebar() -> Steps:
    """Show the camera's view, and the extension's tab of the sidebar."""
    area, _, sidebar = view()
    area.spaces.active.show_region_ui = True
    area.spaces.active.region_3d.view_perspective = "CAMERA"
    yield LONG
    sidebar.active_panel_category = "Grating"
    area.tag_redraw()
    yield LONG


def save_screen(screen: Path, picture: Path) -> None:
    """Save the screen as PNG. Blender's screenshot is black without a graphics card."""
    save_png(screen_pixels(screen), picture)


def save_sidebar(screen: Path, picture: Path) -> None:
    """Save the sidebar as PNG, down to the end of its panel. The region's rounded corners do not count."""
    pixels = _of_region(screen, view()[2])
    inner = pixels[:-_ROW, _ROW:-_TABS]
    last = np.flatnonzero((inner != inner[-1, 0]).any(axis=(1, 2)))[-1]
    save_png(_in_64_tones(pixels[: last + _ROW]), picture)


def save_region(screen: Path, region: bpy.types.Region, picture: Path) -> None:
    """Save a region of Blender's window as PNG."""
    save_png(_in_64_tones(_of_region(screen, region)), picture)


def save_area(screen: Path, area: bpy.types.Area, picture: Path) -> None:
    """Save an area of Blender's window as PNG, in all its tones."""
    save_png(_of_region(screen, area), picture)


def _of_region(screen: Path, region: bpy.types.Region | bpy.types.Area) -> np.ndarray:
    """The pixels of a region or an area of Blender's window."""
    top = window().height - region.y - region.height
    return screen_pixels(screen)[top : top + region.height, region.x : region.x + region.width]


def save_changed(screen: Path, before: np.ndarray, picture: Path) -> None:
    """Save the part of the screen that differs from what it showed before, such as a popup, as PNG without its
    shadow."""
    pixels = screen_pixels(screen)
    rows, columns = np.nonzero((pixels != before).any(axis=2))
    inner = slice(columns.min() + _SHADOW, columns.max() + 1 - _SHADOW)
    save_png(_in_64_tones(pixels[rows.min() : rows.max() + 1 - _SHADOW, inner]), picture)


def _in_64_tones(pixels: np.ndarray) -> np.ndarray:
    """A picture for a page: with fewer tones than the eye sees, which halves the file."""
    return pixels & 252 | 2


def screen_pixels(screen: Path) -> np.ndarray:
    """What the screen shows (rows, cols, 3), from its picture file (display.py)."""
    held = screen.read_bytes()
    # An xwd header has fields of 32 bits, including the start of the pixels and their layout: blue, green, red, unused.
    header_size, _, _, _, width, height, *rest = struct.unpack(">25I", held[:100])
    row_bytes, colours = rest[6], rest[13]
    pixels = np.frombuffer(held, np.uint8, height * row_bytes, header_size + 12 * colours).reshape(height, row_bytes)
    return pixels[:, : 4 * width].reshape(height, width, 4)[:, :, 2::-1]


def save_png(pixels: np.ndarray, picture: Path) -> None:
    """Save pixels (rows, cols, 3) of 8 bits as PNG. Blender's Python may lack Pillow."""
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)  # each row begins with its filter's number, 0 for none
    rows[:, 1:] = pixels.reshape(height, -1)
    header = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)  # 8 bits, RGB
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 9)), (b"IEND", b""))
    picture.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(*each) for each in chunks))


def take_picture(screen: Path, folder: Path, name: str, text: str) -> None:
    """Save a picture of the screen as the next file of the folder, and a line about it in the folder's walk.md."""
    file = f"{len(_lines) + 1:02}_{name}.png"
    save_screen(screen, folder / file)
    _lines.append(f"- `{file}`{text}\n")
    (folder / "walk.md").write_text("".join(_lines))
    print(f"[walk] {file}", flush=True)


def _chunk(kind: bytes, data: bytes) -> bytes:
    """A part of a PNG file."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def play(story: Steps) -> None:
    """Play a story by Blender's timer, then quit. An error is printed and gives exit status 1."""
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
