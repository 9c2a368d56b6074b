# SPDX-License-Identifier: GPL-3.0-or-later
"""What lights a grating: the scene's lamps, lamps that are added for it, and the bright parts of the world."""
