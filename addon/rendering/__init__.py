# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the pictures of a plan. It needs Blender alone, so that a worker of a farm needs no extension."""
