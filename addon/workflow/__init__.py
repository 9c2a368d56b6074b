# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of an artist's work: import, bake, assign, comb, unwrap, follow the lamps, render.

The buttons and the command line call the same functions of this package."""
