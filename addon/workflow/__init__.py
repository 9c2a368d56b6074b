# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of an artist's work: import, bake, assign, comb, unwrap, follow the lamps, render. Both the buttons and the
command line call these functions."""
