# SPDX-License-Identifier: GPL-3.0-or-later
"""The first hour of a new artist with the installed package, in a Blender with a window and event simulation:
`--python first_hour_in_blender.py -- FOLDER SCREEN`.

Each station begins with Blender's start file, counts the artist's acts, and saves a picture and a line in
FOLDER/walk.md. SCREEN is the screen's picture file (display.py). The grid's pictures and the file dialog's fields are
set through their properties; every other act is a click of the mouse. Scenes render with Cycles, because without a
graphics card EEVEE compiles for a minute."""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).resolve().parents[2]))

from devtools.window.hands import LONG, Steps, choose_file, play, press_button, press_in_view, take_picture, view
from devtools.window.hands import window as first_window

FOLDER, SCREEN = (Path(argument) for argument in sys.argv[sys.argv.index("--") + 1 :])
SECOND, RENDERED = 1.0, 12.0
_acts = 0


def act(count: int = 1) -> None:
    """Count acts of the artist."""
    global _acts
    _acts += count


def picture(name: str, text: str) -> None:
    """Save a picture of the screen, and a line with the acts of the station so far."""
    take_picture(SCREEN, FOLDER, name, f", {_acts} act{'s' * (_acts != 1)}: {text}")


def press(command: str, across: float = 0.3) -> Steps:
    """Press a button of the panel."""
    act()
    yield from press_button(command, across)


def begin() -> Steps:
    """Open Blender's start file and the extension's tab: two acts, the key N and a click on the tab."""
    global _acts
    bpy.ops.wm.read_homefile()
    yield SECOND
    bpy.context.scene.render.engine = "CYCLES"
    area, _, sidebar = view()
    area.spaces.active.show_region_ui = True
    yield LONG
    sidebar.active_panel_category = "Grating"
    area.tag_redraw()
    yield LONG
    _acts = 2


def choose(preset: str) -> Steps:
    """Choose a preset in the grid: a click on the picture, and one in the grid."""
    bpy.context.window_manager.natural_gratings_preset = preset
    view()[0].tag_redraw()
    act(2)
    yield SECOND


def put_on(preset: str, name: str, text: str, most: int) -> Steps:
    """Put a preset on the selected mesh and light it, which shows it rendered. `most`: the acts it may take, without
    those of begin()."""
    yield from choose(preset)
    yield from press("bpy.ops.grating.add_preset")
    yield from press("bpy.ops.grating.light_rig")
    yield RENDERED
    assert [lamp for lamp in bpy.context.scene.objects if lamp.name.startswith("Rig")], "no rig"
    assert view()[0].spaces.active.shading.type == "RENDERED"
    picture(name, text)
    assert _acts - 2 <= most, f"{_acts - 2} acts for {name}"


def show_me() -> Steps:
    """From the empty profile to the first coloured snake in three acts."""
    yield from press_in_view("ESC")  # the splash screen
    yield from begin()
    yield 4 * SECOND  # the presets' pictures load
    picture("start", "the tab of a new file: a preset's picture, Show Me, and what can be put on the selected mesh")
    mine = first_window().scene
    yield from press("bpy.ops.grating.show_me")
    yield 3 * RENDERED
    assert first_window().scene != mine and view()[0].spaces.active.shading.type == "RENDERED"
    assert _acts <= 3
    picture("show_me", "Show Me: a corn snake in a scene of its own")
    yield from press("bpy.ops.grating.back_from_show")
    assert first_window().scene == mine and view()[0].spaces.active.shading.type == "SOLID"
    picture("back", "Back to My Scene: the start file as it was")


def discs_and_foils() -> Steps:
    """A CD on the default cube, a gold foil on a plane, a security hologram, and a monkey without a UV map."""
    yield from begin()
    yield from put_on("cd", "cd", "a CD on the default cube", 4)
    yield from press("bpy.ops.grating.why_black", across=0.8)
    picture("why_black", "Why Is It Black? finds nothing that hides the colours")
    yield from press_in_view("ESC")
    for preset, name, text in (
        ("gold_foil", "gold_foil", "a gold foil on a ball"),
        ("security_hologram", "hologram", "a security hologram, whose pattern is Dot Matrix, on a ball"),
    ):
        yield from begin()
        bpy.data.objects.remove(bpy.data.objects["Cube"])
        bpy.ops.mesh.primitive_uv_sphere_add()
        bpy.ops.object.shade_smooth()
        yield SECOND
        yield from put_on(preset, name, text, 4)
    yield from begin()
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_monkey_add(calc_uvs=False)
    yield SECOND
    yield from put_on("silver_foil", "monkey", "a monkey without a UV map: the direction follows its Z axis", 4)


def sticker() -> Steps:
    """A sticker with an own picture on the default cube."""
    yield from begin()
    yield from press("bpy.ops.grating.add_sticker(...from_picture=True")
    act()  # a double click on the file
    yield from choose_file(FOLDER, "logo.png")
    yield from press_in_view("ESC")  # the warning's popup, which also closes when the pointer leaves it
    yield from press("bpy.ops.grating.light_rig")
    yield RENDERED
    assert [thing.name for thing in bpy.context.scene.objects if thing.parent] == ["Sticker"]
    picture("sticker", "a sticker with an own picture on the default cube")
    assert _acts - 2 <= 4, f"{_acts - 2} acts"


def own_scan() -> Steps:
    """A scan is imported with its size, baked, assigned, shown and lit."""
    yield from begin()
    act(5)  # Import Scan, the file, its width, its height, and the dialog's button
    bpy.ops.grating.import_height_map(
        "EXEC_DEFAULT", True, filepath=str(FOLDER / "waves.txt"), size_um=8, height_nm=150
    )
    view()[0].tag_redraw()
    yield 3 * SECOND
    picture("scan", "an own scan: its period, its rating, its levelling, and Bake as the one thing to do next")
    yield from press("bpy.ops.grating.bake")
    while not bpy.context.scene.natural_gratings.active().bake_path:
        yield SECOND
    yield SECOND
    picture("scan_baked", "the scan is baked; the next thing to do is Assign to Cube")
    yield from press("bpy.ops.grating.assign")
    yield from press("bpy.ops.grating.light_rig")
    yield RENDERED
    picture("scan_on_cube", "the scan on the default cube")
    assert _acts - 2 <= 8, f"{_acts - 2} acts"
    folds = bpy.context.window_manager.natural_gratings_folds
    steps = ("surface", "look", "light", "quality")
    for step in steps:
        for each in steps:
            setattr(folds, each, each == step)
        view()[0].tag_redraw()
        yield SECOND
        picture(f"step_{step}", f"the step {step}, opened")


def story() -> Steps:
    bpy.context.preferences.view.smooth_view = 0
    yield LONG
    for station in (show_me, discs_and_foils, sticker, own_scan):
        yield from station()


play(story())
