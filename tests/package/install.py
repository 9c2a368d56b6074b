# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by Blender with an empty user folder: `--python install.py -- ZIP` installs and enables the zip."""

import sys

import bpy

package = sys.argv[sys.argv.index("--") + 1]
bpy.ops.extensions.package_install_files(filepath=package, repo="user_default", enable_on_install=True)
assert "bl_ext.user_default.natural_gratings" in bpy.context.preferences.addons, "it is not enabled"
bpy.ops.wm.save_userpref()
