# SPDX-License-Identifier: GPL-3.0-or-later
"""Snakes whose scales are geometry. Poses, girth, scales and head as arrays; the mesh, bones and skins in Blender."""
