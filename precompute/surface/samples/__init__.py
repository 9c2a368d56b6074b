# SPDX-License-Identifier: GPL-3.0-or-later
"""Synthetic surfaces: line gratings, optical discs and snake skins, reproducible (seeded) and with wrapping edges."""
