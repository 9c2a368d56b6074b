# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes: smooth fields of directions by the connection Laplacian, combs, and UV maps."""
