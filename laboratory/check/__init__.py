# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks a bake by its files alone, without the bake's code. Of precompute it imports
only base, optics, reflectance, colour, surface and measure."""
