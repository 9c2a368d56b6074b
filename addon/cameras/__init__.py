# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene's cameras see of the meshes that show gratings, as arrays."""
