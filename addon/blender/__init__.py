# SPDX-License-Identifier: GPL-3.0-or-later
"""Helpers for Blender itself: versions, windows, renders, changes and custom properties. Independent of gratings."""
