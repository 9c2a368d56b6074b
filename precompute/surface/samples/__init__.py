# SPDX-License-Identifier: GPL-3.0-or-later
"""Synthetic surfaces: line gratings, optical discs, snake skins, and the catalogue of their names.

Every surface is the same at each call (random numbers are seeded), and its edges wrap exactly."""
