# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender itself: its versions, windows, renders, change notices and custom properties. Knows nothing of gratings."""
