# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's lamps: packed into properties of the scene, which materials read."""
