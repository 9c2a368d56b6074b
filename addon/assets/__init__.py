# SPDX-License-Identifier: GPL-3.0-or-later
"""The presets as materials in an asset library, for Blender's Asset Browser."""
