# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of Show Me: a thing that shows a preset, its lamps, its camera and its world."""
