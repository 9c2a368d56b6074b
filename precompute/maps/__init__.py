# SPDX-License-Identifier: GPL-3.0-or-later
"""BRDF maps: pictures of a surface's reflected colours over the hemisphere of views."""
