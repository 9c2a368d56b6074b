# SPDX-License-Identifier: GPL-3.0-or-later
"""Holograms: node groups that turn a grating, stretch its period and dim it from place to place."""
