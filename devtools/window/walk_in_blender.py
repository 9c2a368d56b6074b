# SPDX-License-Identifier: GPL-3.0-or-later
"""An artist's walk through everything that once failed in Blender, on walk_stage.py's file. It runs in a Blender with a
window and event simulation: `--python walk_in_blender.py -- FOLDER SCREEN`.

The panel's buttons are pressed with the mouse, undo and redo with the keyboard. Each station asserts its result, and
adds a picture of the window and a line to FOLDER/walk.md. SCREEN is the screen's picture file (display.py)."""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).resolve().parents[2]))

from devtools.window.hands import (
    LONG,
    Steps,
    choose_file,
    file_dialog,
    find_button,
    move,
    part,
    play,
    press_button,
    press_in_view,
    press_key,
    show_sidebar,
    take_picture,
    view,
)
from devtools.window.hands import window as first_window

FOLDER, SCREEN = (Path(argument) for argument in sys.argv[sys.argv.index("--") + 1 :])
SECOND = 1.0
RENDERED = 3.0  # for the viewport's samples, on two shared processors


def grating():
    """The active grating, fetched each time because undo frees the former object."""
    return bpy.context.scene.natural_gratings.active()


def thing(name: str) -> bpy.types.Object:
    """An object by its name."""
    return bpy.data.objects[name]


def select(*names: str) -> None:
    """Select the named objects, as an undo step."""
    for each in bpy.context.view_layer.objects:
        each.select_set(each.name in names)
    bpy.context.view_layer.objects.active = thing(names[0])
    bpy.ops.ed.undo_push(message=f"select {names[0]}")


def diffracts(name: str) -> bool:
    """Whether a material of the object has diffraction."""
    nodes = part("materials.material").diffraction_nodes
    return any(nodes(slot.material) for slot in thing(name).material_slots)


def picture(name: str, text: str) -> None:
    """Save a picture of the screen and a line about it."""
    take_picture(SCREEN, FOLDER, name, f": {text}")


def dismiss() -> Steps:
    """Close the message popup."""
    x, y = view()[1].x + 20, view()[1].y + 20
    yield from press_key("ESC", x, y)
    move(x, y)
    yield SECOND


def set_up() -> Steps:
    """Show the rendered camera view, the sidebar, and the list of reports."""
    area, _, _ = view()
    area.spaces.active.shading.type = "RENDERED"
    area.spaces.active.overlay.show_floor = area.spaces.active.overlay.show_axis_x = False
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    next(a for a in first_window().screen.areas if a.type == "PROPERTIES").type = "INFO"
    yield from show_sidebar()
    bpy.context.preferences.view.smooth_view = 0
    folds = bpy.context.window_manager.natural_gratings_folds
    folds.look = folds.light = True  # so that their buttons are on the screen
    with bpy.context.temp_override(window=first_window(), area=area, region=view()[1]):
        bpy.ops.view3d.view_center_camera()
    yield SECOND


def menu(name: str, text: str) -> Steps:
    """Open one of the extension's menus, save a picture, and close the menu."""
    region = view()[1]
    first_window().cursor_warp(region.x + region.width // 2, region.y + region.height // 2)
    yield SECOND
    with bpy.context.temp_override(window=first_window(), area=view()[0], region=region):
        bpy.ops.wm.call_menu("INVOKE_DEFAULT", name=f"GRATING_MT_{name}")
    yield SECOND
    picture(name, text)
    yield from press_key("ESC", region.x + 5, region.y + 5)


def import_a_sample() -> Steps:
    """The menu spells discs as people do. The dialog afterwards does not offer the sample as a file."""
    yield from menu("samples", "the menu of samples writes CD, DVD, Blu-ray")
    bpy.ops.grating.import_height_map("EXEC_DEFAULT", True, filepath="sample:cd")
    assert grating().name == "CD"
    grating().coherence_um = 4  # bakes in a quarter of the time
    view()[0].tag_redraw()
    yield RENDERED  # also time for the preview of levelling
    picture("before_anything_is_assigned", "a grating is imported, nothing is assigned: no warning in the panel")


def import_dialog() -> Steps:
    """A file without a size is refused in the words of the dialog. Its fields begin empty."""
    with bpy.context.temp_override(window=first_window(), area=view()[0], region=view()[1]):
        bpy.ops.grating.import_height_map("INVOKE_DEFAULT")
    yield LONG
    assert file_dialog()[1].spaces.active.params.filename == ""
    picture("import_dialog", "the import dialog begins without a file name")
    yield from choose_file(FOLDER, "waves.txt")
    picture("no_size", "a scan without its size is refused: the message names the dialog's field, no flag")
    assert len(bpy.context.scene.natural_gratings.items) == 1
    yield from dismiss()


def bake(delta_e: float, name: str, text: str) -> Steps:
    """Set the colour error, press Bake, watch the progress bar, and wait for the end."""
    operator = part("operators.bake").BakeGrating
    grating().delta_e = delta_e
    bpy.ops.ed.undo_push(message="colour error")
    yield from press_button("bpy.ops.grating.bake")
    told = []
    while operator.job is not None:
        told.append(operator.job.progress()[1])
        if name and told[-1] > 0.3:
            picture(name, text)
            name = ""
        yield 0.2
    yield SECOND
    assert told == sorted(told), f"the bar went back: {told}"
    assert grating().bake_path, "nothing was baked"


def undo_past_the_bake() -> Steps:
    """Undo goes back past the bake, the grating still knows its bake, and redo goes forward."""
    yield from bake(6.0, "baking", "the bake: one bar over all its stages, here and in the status bar")
    path = grating().bake_path
    picture("baked", "the bake's facts in the panel")
    select("Left")
    yield from press_button("bpy.ops.grating.assign")
    yield RENDERED
    picture("assigned", "Assign to Selected on one ball")
    for _ in range(3):  # Assign, the selection, the bake
        yield from press_in_view("Z", ctrl=True)
    assert not diffracts("Left") and grating().material is None
    assert grating().bake_path == path, "undo took the bake"
    picture("undone_past_the_bake", "undone past the bake: the grating still knows its bake, and can be assigned")
    for _ in range(3):
        yield from press_in_view("Z", ctrl=True, shift=True)
    assert diffracts("Left") and grating().bake_path == path
    yield from press_button("bpy.ops.grating.remove_diffraction", across=0.8)
    assert thing("Left").active_material.name == "Shared Paint", thing("Left").active_material
    yield RENDERED
    picture("removed_again", "Remove gives back the paint that Assign had replaced")


def slots() -> Steps:
    """Assign replaces one slot and reports it. Add changes all slots."""
    select("Three")
    yield from press_button("bpy.ops.grating.assign")
    assert [slot.material.name for slot in thing("Three").material_slots][1:] == ["Belly", "Eye"]
    yield RENDERED
    picture("one_of_three_slots", "Assign on three slots: the report says which slot was replaced")
    yield from press_in_view("Z", ctrl=True)
    yield from press_button("bpy.ops.grating.add_diffraction", across=0.5)
    nodes = part("materials.material").diffraction_nodes
    assert all(nodes(slot.material) for slot in thing("Three").material_slots)
    yield RENDERED
    picture("all_three_slots", "Add to Materials serves all three slots")


def shared_material() -> Steps:
    """Remove on one of two objects that share a material; then Assign; then Assign after a node was deleted by hand."""
    select("Left", "Right")
    yield from press_button("bpy.ops.grating.add_diffraction", across=0.5)
    assert diffracts("Left") and diffracts("Right")
    select("Left")
    yield from press_button("bpy.ops.grating.remove_diffraction", across=0.8)
    assert diffracts("Right") and not diffracts("Left")
    yield RENDERED
    picture("removed_from_one_of_two", "Remove on the left ball: the right one of the same material keeps it")
    yield from press_button("bpy.ops.grating.assign")
    assert diffracts("Left")
    tree = grating().material.node_tree
    for node in part("materials.material").diffraction_nodes(grating().material):
        tree.nodes.remove(node)
    bpy.ops.ed.undo_push(message="delete node")
    assert not diffracts("Left")
    yield from press_button("bpy.ops.grating.assign")
    assert diffracts("Left")
    yield RENDERED
    picture("assigned_after_the_node_was_deleted", "Assign made the Diffraction node again that had been deleted")


def baked_again() -> Steps:
    """A new bake shows in all materials, under the same names."""

    def names():
        return sorted(one.name for each in ("images", "node_groups", "materials") for one in getattr(bpy.data, each))

    before, path = names(), grating().bake_path
    yield from bake(1.0, "", "")
    assert names() == before, set(names()) ^ set(before)
    assert grating().bake_path != path
    yield RENDERED
    picture("baked_again", "baked again, finer: all three objects show the new bake; no .001 in the file")
    yield from press_in_view("Z", ctrl=True)
    assert grating().bake_path == path and Path(path).is_file()
    yield from press_in_view("Z", ctrl=True, shift=True)
    assert grating().bake_path != path and names() == before


def refusals() -> Steps:
    """What cannot be done gives a one-line error and changes nothing."""
    select("Suzanne", "Broken")
    thing("Suzanne").data.materials.append(bpy.data.materials.new("Plain"))
    yield from press_button("bpy.ops.grating.add_diffraction", across=0.5)
    assert not diffracts("Suzanne")
    picture("add_failed", "Add with a material that has no output: the error; the other material is as it was")
    yield from dismiss()
    select("Guest")
    yield from press_button("bpy.ops.grating.assign")
    picture("linked", "Assign on a linked object: one line with the remedy")
    yield from dismiss()
    with bpy.context.temp_override(window=first_window(), area=view()[0], region=view()[1]):
        thing("Guest").override_create(remap_local_usages=True)
    select("Guest")
    yield from press_button("bpy.ops.grating.assign")
    assert diffracts("Guest")
    yield RENDERED
    picture("overridden", "Assign on its library override")


def passed_over() -> Steps:
    """Warnings name a curve, and UV islands."""
    select("Right", "Curve")
    yield from press_button("bpy.ops.grating.assign")
    assert diffracts("Right") and not diffracts("Curve")
    picture("curve", "a curve among the selected: named, with the remedy")
    select("Curve")
    yield SECOND
    x, y = yield from find_button("bpy.ops.grating.assign")
    move(x, y - 300)  # a tooltip appears where the pointer comes to rest
    yield SECOND
    move(x, y)
    yield SECOND
    move(x + 2, y)
    yield LONG
    picture("curve_alone", "a curve alone: the grey button says why")
    select("Suzanne")
    yield from press_button("bpy.ops.grating.assign")
    assert diffracts("Suzanne")
    yield RENDERED
    picture("islands", "a mesh of many UV islands: the report says that the colours jump")


def lamps() -> Steps:
    """A lamp is hidden, changes type, is deleted, and another is added. Diffraction follows automatically."""

    def followed():
        return [lamp.name for lamp in part("lamps.follow").followed_lamps(bpy.context.scene)]

    sun = thing("Sun")
    sun.hide_render = True
    yield 2 * RENDERED
    picture("lamp_not_rendered", "the sun is left out of renders: no colours, and the panel says that it is hidden")
    sun.hide_render = False
    sun.hide_set(True)
    yield 2 * RENDERED
    picture("lamp_hidden", "the sun is hidden by its eye, which hides it from the viewport")
    sun.hide_set(False)
    sun.data.type = "SPOT"
    sun = thing("Sun")
    sun.location, sun.data.energy = (0, 0, 8), 600
    yield 2 * RENDERED
    assert followed() == ["Sun"]
    picture("lamp_of_another_kind", "the sun is made a spot: the colours are the spot's, without a button pressed")
    bpy.data.objects.remove(thing("Sun"))
    yield 2 * RENDERED
    assert followed() == []
    picture("last_lamp_deleted", "the last lamp is deleted: no colours are left, and the panel offers a light rig")
    yield from press_button("bpy.ops.grating.light_rig")
    yield 2 * RENDERED
    assert sorted(followed()) == ["Card", "Rig Sun", "Second Card"]
    picture("light_rig", "Light Rig was pressed: the colours are back, and the metal has cards to reflect")


def without_a_scan() -> Steps:
    """A preset brings its matter and its plate. A grating by its parameters is made in a dialog."""
    yield from menu("presets", "the menu of presets")
    bpy.ops.grating.add_preset("EXEC_DEFAULT", True, preset="cd", assign=False)
    assert grating().matter == "ALUMINIUM" and grating().plate_ior > 1.5
    view()[0].tag_redraw()
    yield RENDERED
    picture("preset", "the preset CD in the panel: aluminium under a plate")
    with bpy.context.temp_override(window=first_window(), area=view()[0], region=view()[1]):
        bpy.ops.grating.add_grating("INVOKE_DEFAULT")
    yield LONG
    picture("parameters", "Grating by Parameters: kind, period or lines per millimetre, depth, disorder")
    yield from dismiss()


def another_file() -> Steps:
    """Opening another file ends a running bake."""
    operator = part("operators.bake").BakeGrating
    grating().delta_e = 0.4
    yield from press_button("bpy.ops.grating.bake")
    job = operator.job
    assert job is not None and job.running, "the bake ended too early"
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "guest.blend"))
    yield SECOND
    assert operator.job is None and not job.running, "the bake went on"


def story() -> Steps:
    yield LONG
    yield from set_up()
    for station in (import_a_sample, import_dialog, undo_past_the_bake, slots, shared_material, baked_again, refusals,
                    passed_over, lamps, without_a_scan, another_file):  # fmt: skip
        yield from station()


play(story())
