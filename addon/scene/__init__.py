# SPDX-License-Identifier: GPL-3.0-or-later
"""The gratings that a scene holds, and the one module that knows the differences between Blender versions."""
