# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns height maps into diffraction tables: the wave optics of Natural Gratings, without Blender."""
