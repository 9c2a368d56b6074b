# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by Blender: `--python use_plain_folder.py -- FILE`.

Enables the add-on of a plain folder, imports a scan as text, puts a shipped preset on a plane and saves FILE."""

import importlib
import sys
from pathlib import Path

import addon_utils
import bpy

MODULE = "natural_gratings"
FILE = Path(sys.argv[sys.argv.index("--") + 1])

listed = {module.__name__: addon_utils.module_bl_info(module) for module in addon_utils.modules()}
assert listed[MODULE]["name"] == "Natural Gratings", listed.get(MODULE)
assert addon_utils.enable(MODULE) is not None
folders = importlib.import_module(f"{MODULE}.addon.gratings.cache_folder")
assert folders.EXTENSION == MODULE and folders.cache_folder().is_absolute()

bpy.ops.mesh.primitive_plane_add()
assert bpy.ops.grating.add_preset(preset="gold_foil", assign=True) == {"FINISHED"}
assert bpy.context.object.active_material is bpy.context.scene.natural_gratings.active().material
text = FILE.with_suffix(".txt")
text.write_text("\n".join(" ".join(str((x + y) % 7) for x in range(16)) for y in range(16)))
assert bpy.ops.grating.import_height_map(filepath=str(text), size_um=4, height_nm=10) == {"FINISHED"}
assert len(bpy.context.scene.natural_gratings.items) == 2
bpy.ops.wm.save_as_mainfile(filepath=str(FILE))
