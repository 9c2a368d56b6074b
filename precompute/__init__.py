# SPDX-License-Identifier: GPL-3.0-or-later
"""Height maps to diffraction tables: the wave optics of Natural Gratings, without Blender."""
