# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by a Blender with a window and --enable-event-simulate: `--python press_buttons.py -- BAKE`.

Plays an artist at work on the open file, by mouse and keyboard events only: clicks the floor, presses Assign to
Selected, clicks the ball, presses Add to Materials and the panel's other buttons, undoes each with Ctrl-Z and redoes
it, and saves with Ctrl-S. The script only sets the stage: the view, the open tab, the bake, and the panel's open steps.
It quits at the end.
"""

import importlib
import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).resolve().parents[2]))

from devtools.window.hands import LONG, click_object, play, press_button, press_in_view, show_sidebar, window

BAKE = sys.argv[sys.argv.index("--") + 1]


def press_undo_redo(command, across=0.3):
    """Steps: press the button, undo it, which must restore everything, and redo it."""
    yield from undo_redo(command, press_button(command, across))


def choose_undo_redo(lights):
    """Steps: the same for a choice of lights. The script chooses the menu's entry."""
    yield from undo_redo(lights, choose(lights))


def choose(lights):
    with bpy.context.temp_override(window=window()):
        assert bpy.ops.grating.lights("EXEC_DEFAULT", True, lights=lights) == {"FINISHED"}
    yield LONG


def undo_redo(name, steps):
    before = contents()
    yield from steps
    after = contents()
    assert after != before, f"{name} did nothing"
    yield from press_in_view("Z", ctrl=True)
    assert contents() == before, f"Ctrl-Z after {name}: {differences(before, contents())}"
    yield from press_in_view("Z", ctrl=True, shift=True)
    assert contents() == after, f"Shift-Ctrl-Z after {name}: {differences(after, contents())}"


def contents():
    """Everything that the buttons may change in a file, as lines."""
    lines = {f"{kind} {one.name}" for kind in ("materials", "node_groups", "images") for one in getattr(bpy.data, kind)}
    for material in bpy.data.materials:
        lines |= {f"{material.name}: {link.from_node.name} {link.to_node.name}" for link in material.node_tree.links}
        lines.add(f"{material.name}: {material.cycles.emission_sampling} {sorted(material.keys())}")
    for group in bpy.data.node_groups:
        lines.add(f"{group.name}: {group.get('ng_lights')}, {len(group.nodes)} nodes, {len(group.links)} links")
    for thing in bpy.data.objects:
        lines.add(f"{thing.name}: {[slot.material and slot.material.name for slot in thing.material_slots]}")
    for scene in bpy.data.scenes:
        drivers = scene.animation_data.drivers if scene.animation_data else ()
        lines |= {f"{scene.name} {curve.data_path} {curve.array_index}" for curve in drivers}
        lines.add(f"{scene.name} {sorted(scene.keys())}")
    return lines


def differences(wanted, found):
    return sorted(f"missing {line}" for line in wanted - found) + sorted(f"extra {line}" for line in found - wanted)


def set_the_stage():
    """Steps: set the camera's view, the sidebar's tab, and the bake as the active grating."""
    grating = bpy.context.scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "blazed", BAKE
    yield from show_sidebar()


def open_steps():
    """Open the panel's steps Look and Light."""
    folds = bpy.context.window_manager.natural_gratings_folds
    folds.look = folds.light = True


def add_lamp():
    """Add a lamp, as a separate undo step."""
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Late", bpy.data.lights.new("Late", "SUN")))
    bpy.ops.ed.undo_push(message="a lamp")


def followed():
    """The names of the lamps that the scene follows."""
    module = importlib.import_module("bl_ext.user_default.natural_gratings.addon.lamps.follow")
    return sorted(lamp.name for lamp in module.followed_lamps(bpy.context.scene))


def story():
    """The steps; each yields the seconds until the next."""
    yield LONG
    yield from set_the_stage()
    yield from click_object("Floor", (0.35, 0.3, 0))
    yield from press_undo_redo("bpy.ops.grating.assign")
    assert bpy.data.objects["Floor"].active_material, "Assign to Selected assigned nothing"
    assert followed() == ["Bulb", "Torch", "Window"]
    for lights in ("ALL", "LAMPS", "REST"):
        yield from choose_undo_redo(lights)
    yield from click_object("Ball", (0.08, -0.05, 0.3))
    open_steps()
    yield from press_undo_redo("bpy.ops.grating.add_diffraction()", across=0.45)
    yield from press_undo_redo("bpy.ops.grating.remove_diffraction", across=0.75)
    yield from press_undo_redo("bpy.ops.grating.add_diffraction()", across=0.45)
    groups = [n for n in bpy.data.materials["Old Paint"].node_tree.nodes if n.type == "GROUP"]
    assert groups, "Add to Materials added nothing"
    yield from press_undo_redo("bpy.ops.grating.new_material")
    yield from press_undo_redo("bpy.ops.grating.add_diffraction_lamp", across=0.85)
    assert bpy.data.objects["Diffraction Lamp"].parent == bpy.data.objects["Ball"]
    assert followed() == ["Bulb", "Torch", "Window"]
    add_lamp()
    yield LONG
    assert followed() == ["Bulb", "Late", "Torch", "Window"]
    after = contents()
    yield from press_in_view("Z", ctrl=True)
    assert followed() == ["Bulb", "Torch", "Window"]
    yield from press_in_view("Z", ctrl=True, shift=True)
    assert followed() == ["Bulb", "Late", "Torch", "Window"]
    assert contents() == after, differences(after, contents())
    yield from press_in_view("S", ctrl=True)
    assert not bpy.data.is_dirty, "Ctrl-S did not save"


play(story())
