# SPDX-License-Identifier: GPL-3.0-or-later
"""The pages' pictures of the panel, in a Blender with a window and event simulation:
`--python screens_in_blender.py -- FOLDER SCREEN`.

The steps are those of docs/first_steps.md: a new file, a scan, its bake, the mesh, the lamps; then a snake. FOLDER gets
a PNG of the sidebar at each, and of menus and dialogs. SCREEN is the screen's picture file (display.py); its folder
gets the scan."""

import sys
from math import sin
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).resolve().parents[2]))

from devtools.window.hands import (
    LONG,
    Steps,
    click,
    find_button,
    look_installed,
    move,
    part,
    play,
    press_button,
    press_in_view,
    save_changed,
    save_region,
    save_sidebar,
    screen_pixels,
    show_sidebar,
    view,
    window,
)

FOLDER, SCREEN = (Path(argument) for argument in sys.argv[sys.argv.index("--") + 1 :])
SCALE = 1.4  # of the interface, so that the pictures are sharp on a screen with small pixels
SECOND = 1.0
ROW = 28  # pixels from a row of the panel to the next, at this scale


def set_up() -> Steps:
    """Show Blender's start file with the extension's tab, at a larger scale, with a sidebar that hides nothing."""
    look_installed()
    preferences = bpy.context.preferences
    preferences.view.ui_scale, preferences.view.smooth_view = SCALE, 0
    preferences.view.show_tooltips = False
    preferences.system.use_region_overlap = False
    yield from press_in_view("ESC")  # the splash screen
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.preview_samples = "CYCLES", 1
    scene.render.preview_pixel_size = "8"
    yield from show_sidebar()


def import_scan() -> None:
    """Import a made-up scan of 13 waves on 16 um, whose lines are shifted and whose sample is tilted."""
    scan = SCREEN.with_name("Skin.txt")
    rows = ([sin(0.64 * x) + 0.01 * x + 0.4 * sin(y * y) for x in range(128)] for y in range(128))
    scan.write_text("\n".join(" ".join(f"{height:.4f}" for height in row) for row in rows))
    bpy.ops.grating.import_height_map("EXEC_DEFAULT", True, filepath=str(scan), size_um=16, height_nm=60)


def leave_buttons() -> None:
    """Move the pointer away from the panel, so that no button is highlighted."""
    move(view()[1].x + 9, view()[1].y + 9)


def picture(name: str, open_part: str = "", seconds: float = 3 * SECOND) -> Steps:
    """Save a picture of the sidebar in which one part is open."""
    leave_buttons()
    folds = bpy.context.window_manager.natural_gratings_folds
    for _ in range(2):  # when its turn comes, a part opens by itself
        for each in ("surface", "look", "light", "quality"):
            setattr(folds, each, each == open_part)
        view()[0].tag_redraw()
        yield seconds
    save_sidebar(SCREEN, FOLDER / f"{name}.png")
    print(f"[walk] {name}.png", flush=True)


def popup(name: str, opening: Steps) -> Steps:
    """Save a picture of what steps open, such as a menu or a dialog, and close it."""
    leave_buttons()
    yield 2 * SECOND
    before = screen_pixels(SCREEN)
    yield from opening
    yield 2 * SECOND
    save_changed(SCREEN, before, FOLDER / f"{name}.png")
    print(f"[walk] {name}.png", flush=True)
    yield from press_in_view("ESC")


def why_black() -> Steps:
    """Save a picture of the popup that lists why the mesh is black: its only lamp is hidden."""
    lamp = bpy.data.objects["Light"]
    lamp.hide_render = True
    yield from popup("why_black", click(*(yield from find_button("bpy.ops.grating.why_black"))))
    lamp.hide_render = False


def snake() -> Steps:
    """Save a picture of the settings of a new snake, in the panel Adjust Last Operation."""
    area, region, _ = view()
    with bpy.context.temp_override(window=window(), area=area, region=region):
        bpy.ops.grating.add_snake("EXEC_DEFAULT", True)
    yield 5 * SECOND
    panel = next(region for region in area.regions if region.type == "HUD")
    yield from click(panel.x + ROW, panel.y + panel.height / 2)
    yield 5 * SECOND
    save_region(SCREEN, panel, FOLDER / "snake.png")
    print("[walk] snake.png", flush=True)


def story() -> Steps:
    yield LONG
    yield from set_up()
    yield from picture("start", seconds=5 * SECOND)  # the presets' pictures load
    import_scan()
    yield from picture("scan", "surface", 5 * SECOND)
    yield from press_button("bpy.ops.grating.bake")
    while part("operators.bake").BakeGrating.job is not None:
        yield SECOND
    assert bpy.context.scene.natural_gratings.active().bake_path, "nothing was baked"
    yield from picture("bake", "quality")
    yield from press_button("bpy.ops.grating.assign")
    yield from picture("look", "look")
    x, y = yield from find_button("bpy.ops.grating.vary", across=0.6)
    yield from popup("variation", click(x, y))
    yield from popup("pattern", click(x, y - ROW))
    yield from why_black()
    x, y = yield from find_button("bpy.ops.grating.light_rig")
    yield from popup("light_rig", click(x + 8 * ROW, y))
    yield from press_button("bpy.ops.grating.light_rig")
    yield from picture("light", "light", 5 * SECOND)
    yield from snake()


play(story())
