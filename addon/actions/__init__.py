# SPDX-License-Identifier: GPL-3.0-or-later
"""Actions on a scene: import a height map, bake it, make and assign its material, follow the lamps, render.

The buttons and the command line call the same functions of this package."""
