# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Grating in the 3D view's sidebar, with its lists and menus."""
