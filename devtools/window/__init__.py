# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender with a window that is used by simulated hands: the walk of an artist, and his first hour."""
