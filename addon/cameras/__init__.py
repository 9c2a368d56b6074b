# SPDX-License-Identifier: GPL-3.0-or-later
"""What the cameras of a scene see of the meshes that show gratings, as arrays."""
