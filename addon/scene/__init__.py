# SPDX-License-Identifier: GPL-3.0-or-later
"""The gratings that a scene holds, and every difference between Blender versions."""
