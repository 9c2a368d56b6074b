# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by a Blender with a window and --enable-event-simulate: `--python press_buttons.py -- BAKE`.

An artist at work on the open file: clicks the floor, presses Assign to Selected, clicks the ball, presses Add to
Materials and the panel's other buttons, each undone with Ctrl-Z and done again, and saves with Ctrl-S; all by mouse and
keyboard events. Where a button lies is found as a person finds it, by
looking under the pointer: Ctrl-C over a button copies what it does. The script only sets the stage: the view, the open
tab, the bake. It quits at the end; what went wrong is in the exit status and the output.
"""

import importlib
import os
import sys
import traceback

import bpy
from bpy_extras.view3d_utils import location_3d_to_region_2d

BAKE = sys.argv[sys.argv.index("--") + 1]
# Seconds that Blender has for an event, and for one that builds a node group.
MOMENT, LONG = 0.05, 2.0
ROW = 8  # pixels; a button is 20 high


def window():
    return bpy.context.window_manager.windows[0]


def view():
    """The 3D view, its window region and its sidebar."""
    area = next(a for a in window().screen.areas if a.type == "VIEW_3D")
    regions = {region.type: region for region in area.regions}
    return area, regions["WINDOW"], regions["UI"]


def move(x, y):
    window().event_simulate("MOUSEMOVE", "NOTHING", x=int(x), y=int(y))


def click(x, y):
    """Steps: the pointer goes there, then the button goes down and up."""
    move(x, y)
    yield MOMENT
    for value in ("PRESS", "RELEASE"):
        window().event_simulate("LEFTMOUSE", value, x=int(x), y=int(y))
        yield MOMENT


def press_key(key, x, y, **modifiers):
    for value in ("PRESS", "RELEASE"):
        window().event_simulate(key, value, x=int(x), y=int(y), **modifiers)
        yield MOMENT


def press_button(command, across=0.3):
    """Steps: finds the button that runs the command so far across the sidebar, and clicks it."""
    sidebar = view()[2]
    x = sidebar.x + sidebar.width * across
    for y in range(sidebar.y + sidebar.height - ROW, sidebar.y, -ROW):
        bpy.context.window_manager.clipboard = ""
        move(x, y)
        yield MOMENT
        yield from press_key("C", x, y, ctrl=True)
        if bpy.context.window_manager.clipboard.startswith(command):
            print(f"{command} at {x:.0f}, {y}", flush=True)
            yield from click(x, y)
            yield LONG
            return
    raise AssertionError(f"no button in the sidebar runs {command}")


def press_undo_redo(command, across=0.3):
    """Steps: presses the button, undoes it, which must leave all as it was, and does it again."""
    before = contents()
    yield from press_button(command, across)
    after = contents()
    assert after != before, f"{command} did nothing"
    yield from press_in_view("Z", ctrl=True)
    assert contents() == before, f"Ctrl-Z after {command}: {differences(before, contents())}"
    yield from press_in_view("Z", ctrl=True, shift=True)
    assert contents() == after, f"Shift-Ctrl-Z after {command}: {differences(after, contents())}"


def press_in_view(key, **modifiers):
    """Steps: presses a key over the 3D view."""
    region = view()[1]
    x, y = region.x + region.width / 4, region.y + region.height / 2
    move(x, y)
    yield MOMENT
    yield from press_key(key, x, y, **modifiers)
    yield LONG


def contents():
    """What the buttons may change in a file, a line for each."""
    lines = {f"{kind} {one.name}" for kind in ("materials", "node_groups", "images") for one in getattr(bpy.data, kind)}
    for material in bpy.data.materials:
        lines |= {f"{material.name}: {link.from_node.name} {link.to_node.name}" for link in material.node_tree.links}
        lines.add(f"{material.name}: {material.cycles.emission_sampling} {sorted(material.keys())}")
    for thing in bpy.data.objects:
        lines.add(f"{thing.name}: {[slot.material and slot.material.name for slot in thing.material_slots]}")
    for scene in bpy.data.scenes:
        drivers = scene.animation_data.drivers if scene.animation_data else ()
        lines |= {f"{scene.name} {curve.data_path} {curve.array_index}" for curve in drivers}
        lines.add(f"{scene.name} {sorted(scene.keys())}")
    return lines


def differences(wanted, found):
    return sorted(f"missing {line}" for line in wanted - found) + sorted(f"extra {line}" for line in found - wanted)


def click_object(name, at):
    """Steps: clicks the object in the 3D view, at a place of the world on it."""
    area, region, _ = view()
    place = location_3d_to_region_2d(region, area.spaces.active.region_3d, at)
    yield from click(region.x + place.x, region.y + place.y)
    selected = [o.name for o in bpy.context.view_layer.objects if o.select_get()]
    assert selected == [name], f"clicked {name}, selected {selected}"


def set_the_stage():
    """Steps: the camera's view, the sidebar's tab, the bake as the active grating."""
    area, _, sidebar = view()
    grating = bpy.context.scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "blazed", BAKE
    area.spaces.active.show_region_ui = True
    area.spaces.active.region_3d.view_perspective = "CAMERA"
    yield LONG
    sidebar.active_panel_category = "Grating"
    area.tag_redraw()
    yield LONG


def add_lamp():
    """A lamp more, as a step of its own for undo."""
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Late", bpy.data.lights.new("Late", "SUN")))
    bpy.ops.ed.undo_push(message="a lamp")


def story():
    """The steps; each yields the seconds until the next."""
    yield LONG
    yield from set_the_stage()
    yield from click_object("Floor", (0.45, 0.3, 0))
    yield from press_undo_redo("bpy.ops.grating.assign")
    assert bpy.data.objects["Floor"].active_material, "Assign to Selected assigned nothing"
    is_up_to_date = importlib.import_module("bl_ext.user_default.natural_gratings.addon.lamps.follow").is_up_to_date
    assert is_up_to_date(bpy.context.scene)
    yield from click_object("Ball", (0.08, -0.05, 0.3))
    yield from press_undo_redo("bpy.ops.grating.add_diffraction")
    yield from press_undo_redo("bpy.ops.grating.remove_diffraction", across=0.7)
    yield from press_undo_redo("bpy.ops.grating.add_diffraction")
    groups = [n for n in bpy.data.materials["Old Paint"].node_tree.nodes if n.type == "GROUP"]
    assert groups, "Add to Materials added nothing"
    yield from press_undo_redo("bpy.ops.grating.new_material")
    add_lamp()
    yield from press_undo_redo("bpy.ops.grating.update_lights", across=0.84)
    yield from press_in_view("S", ctrl=True)
    assert not bpy.data.is_dirty, "Ctrl-S did not save"


def play(steps):
    """The next step, by Blender's timer."""
    try:
        return next(steps)
    except StopIteration:
        os._exit(0)
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)


steps = story()
bpy.app.timers.register(lambda: play(steps), first_interval=1.0)
