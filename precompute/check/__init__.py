# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks a bake by its files alone, without the bake's code. Imports only base, optics, colour, surface and measure."""
