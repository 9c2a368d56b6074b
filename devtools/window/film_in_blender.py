# SPDX-License-Identifier: GPL-3.0-or-later
"""The frames of the film of Show Me, in a Blender with a window and event simulation:
`--python film_in_blender.py -- FOLDER SCREEN`.

From Blender's start file the pointer presses Show Me for a CD, and drags the view around it. FOLDER gets a PNG of the
3D view for each frame. SCREEN is the screen's picture file (display.py)."""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).resolve().parents[2]))

from devtools.window.hands import (
    LONG,
    MOMENT,
    Steps,
    find_button,
    look_installed,
    move,
    play,
    press_button,
    press_in_view,
    save_area,
    show_sidebar,
    view,
    window,
)

FOLDER, SCREEN = (Path(argument) for argument in sys.argv[sys.argv.index("--") + 1 :])
SHOW_ME = "bpy.ops.grating.show_me"
# Frames of the start, of the pointer on the button, of the disc at rest, and of the drag; pixels of a frame's drag.
START, POINTED, SHOWN, DRAGGED, STEP = 6, 6, 8, 40, 4
# Turns of the wheel towards the disc.
NEARER = 5
# Seconds until the viewport has rendered a frame on a processor.
RENDERED, FIRST_RENDERED = 4.0, 25.0
_frames = 0


def frames(count: int = 1) -> None:
    """Save what the screen shows as the next frames."""
    global _frames
    for _ in range(count):
        save_area(SCREEN, view()[0], FOLDER / f"{_frames:03}.png")
        _frames += 1


def drag() -> Steps:
    """Turn the view around the disc, from nearer."""
    region = view()[1]
    x, y = region.x + region.width // 3, region.y + region.height // 2
    move(x, y)
    yield MOMENT
    yield from turn(x, y, 1)  # leaves the camera, whose frame the wheel would zoom
    for _ in range(NEARER):
        window().event_simulate("WHEELUPMOUSE", "PRESS", x=x, y=y)
        yield MOMENT
    yield from turn(x, y, DRAGGED)


def turn(x: int, y: int, steps: int) -> Steps:
    """Drag with the middle mouse button, and save a frame at each step."""
    window().event_simulate("MIDDLEMOUSE", "PRESS", x=x, y=y)
    for step in range(steps):
        window().event_simulate("MOUSEMOVE", "NOTHING", x=x + STEP * step, y=y - step)
        yield RENDERED
        frames()
    window().event_simulate("MIDDLEMOUSE", "RELEASE", x=x + STEP * steps, y=y - steps)
    yield MOMENT


def story() -> Steps:
    yield LONG
    yield from press_in_view("ESC")  # the splash screen
    look_installed()
    bpy.context.window_manager.natural_gratings_preset = "cd"
    bpy.context.preferences.view.show_tooltips = False
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.preview_samples = "CYCLES", 8
    yield from show_sidebar()
    yield 5 * LONG  # the presets' pictures load
    frames(START)
    yield from find_button(SHOW_ME)
    yield LONG
    frames(POINTED)
    yield from press_button(SHOW_ME)
    window().scene.render.preview_pixel_size = "1"  # else a moving view has large pixels
    yield FIRST_RENDERED
    frames(SHOWN)
    yield from drag()


play(story())
