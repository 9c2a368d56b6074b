# SPDX-License-Identifier: GPL-3.0-or-later
"""Registering and unregistering the extension, as an artist does who switches it off and on, leaves nothing behind."""

import os
import sys
from pathlib import Path
from types import FunctionType, SimpleNamespace

import bpy
import pytest

from tests.addon.layout import Layout, context_of

TIMES = 50
# The rounds after which memory counts: the first ones fill Python's and Blender's pools.
WARM = 10
# Growth that the rounds after them may have. If each kept one of the presets' pictures, at Blender's 128 x 128 pixels
# of 4 bytes, it would be 39 x 64 KiB = 2.4 MiB; half of that finds it. Measured: 0 to 16 KiB.
BYTES_MAX = (TIMES - 1 - WARM) * 128 * 128 * 4 // 2
MENUS = (
    bpy.types.TOPBAR_MT_file_import,
    bpy.types.VIEW3D_MT_light_add,
    bpy.types.VIEW3D_MT_mesh_add,
    bpy.types.VIEW3D_MT_object,
    bpy.types.NODE_MT_shader_node_add_all,
)


def handlers():
    """The number of functions of each of Blender's events."""
    lists = {name: getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers)}
    return {name: len(each) for name, each in lists.items() if isinstance(each, list)}


def left_in_blender(package):
    """What Blender still holds of the add-on."""
    yield from (f"class {cls.__name__}" for cls in package.CLASSES if cls.is_registered)
    yield from (f"type {name}" for name in dir(bpy.types) if name.startswith("GRATING_"))
    yield from (name for name in ("natural_gratings",) if hasattr(bpy.types.Scene, name))
    yield from (name for name in dir(bpy.types.WindowManager) if name.startswith("natural_gratings"))
    for menu in MENUS:
        entries = menu.draw._draw_funcs
        yield from (f"menu entry of {entry.__module__}" for entry in entries if package.__name__ in entry.__module__)
    for keymap in bpy.context.window_manager.keyconfigs.addon.keymaps:
        yield from (f"key of {item.idname}" for item in keymap.keymap_items if item.idname.startswith("grating."))
    modules = [module for name, module in list(sys.modules.items()) if name.startswith(package.__name__)]
    functions = {each for module in modules for each in vars(module).values() if isinstance(each, FunctionType)}
    yield from (f"timer {each.__qualname__}" for each in functions if bpy.app.timers.is_registered(each))


def open_files():
    """The number of open file handles."""
    return len(list(Path("/proc/self/fd").iterdir()))


def resident():
    """The process's memory, in bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.fixture
def package(addon, scene):
    """The add-on, unregistered; registered again at the end."""
    addon.package.unregister()
    yield addon.package
    if not hasattr(bpy.types.Scene, "natural_gratings"):
        addon.package.register()


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_register_and_unregister_leave_nothing(addon, package):
    counts, files, memory = handlers(), 0, 0
    for number in range(TIMES):
        package.register()
        addon.panel.GratingPanel.draw(SimpleNamespace(layout=Layout()), context_of())
        assert addon.preset_pictures._pictures is not None
        package.unregister()
        assert handlers() == counts
        assert list(left_in_blender(package)) == []
        assert addon.preset_pictures._pictures is None and not addon.preset_pictures._items
        if number == WARM:
            files, memory = open_files(), resident()
    assert open_files() <= files
    assert resident() - memory <= BYTES_MAX
    package.register()
    assert bpy.ops.grating.import_height_map(filepath="sample:flat") == {"FINISHED"}
