# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake judged from its files alone, with no code of the bake. It imports base, optics, colour, surface and
measure."""
