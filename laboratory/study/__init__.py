# SPDX-License-Identifier: GPL-3.0-or-later
"""Studies of methods and surfaces: the period implied by a method's response, the bake's colours, the efficiencies of
gratings, and N slits."""
