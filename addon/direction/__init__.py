# SPDX-License-Identifier: GPL-3.0-or-later
"""The direction of the scan on the surface: its normal and tangent, as nodes and at single points."""
