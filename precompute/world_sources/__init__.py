# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a world, seen from one point: its compact bright parts as a few sources, and the rest."""
