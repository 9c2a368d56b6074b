# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth fields of directions on a triangle mesh: tangent planes, the connection Laplacian, combs."""
