# SPDX-License-Identifier: GPL-3.0-or-later
"""Studies of methods and surfaces: the periods that a method's response implies, the bake's colours, the efficiencies
of gratings, and N slits."""
