# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a scene's world as Cycles renders it, and its compact bright parts as a few sources."""
