# SPDX-License-Identifier: GPL-3.0-or-later
"""The Grating panel in the 3D view's sidebar, with its lists and menus."""
