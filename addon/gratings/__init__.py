# SPDX-License-Identifier: GPL-3.0-or-later
"""The gratings of a scene and their settings, as the .blend file stores them."""
