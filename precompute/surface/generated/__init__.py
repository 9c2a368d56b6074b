# SPDX-License-Identifier: GPL-3.0-or-later
"""Gratings by their parameters: kind, period, depth and disorder, reproducible (seeded) and with wrapping edges."""
