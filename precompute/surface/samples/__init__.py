# SPDX-License-Identifier: GPL-3.0-or-later
"""Synthetic surfaces: exact, seeded, and wrapping at their edges."""
