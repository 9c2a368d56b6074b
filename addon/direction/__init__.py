# SPDX-License-Identifier: GPL-3.0-or-later
"""The direction of the scan on a surface (normal and tangent), as nodes and in NumPy."""
