# SPDX-License-Identifier: GPL-3.0-or-later
"""Splits the light of a world, seen from one point, into a few sources for its compact bright parts, and the rest."""
