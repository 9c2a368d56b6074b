# SPDX-License-Identifier: GPL-3.0-or-later
"""Closures that answer to light of every kind: the mirror image, and one order drawn at random."""
