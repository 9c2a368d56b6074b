# SPDX-License-Identifier: GPL-3.0-or-later
"""Studies of methods and surfaces: BRDF maps, periods, efficiencies, slits, speed against error."""
