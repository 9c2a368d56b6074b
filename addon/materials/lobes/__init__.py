# SPDX-License-Identifier: GPL-3.0-or-later
"""Closures for light from all directions: the mirror image, and one randomly drawn order."""
