# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake judged from its files alone, without any code of the bake. This room imports base, optics, colour, surface and
measure only."""
