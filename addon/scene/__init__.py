# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene holds of the add-on, and every difference between Blender versions."""
