# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame of the scan on the surface: its normal and tangent, computed by nodes."""
