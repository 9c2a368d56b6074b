# SPDX-License-Identifier: GPL-3.0-or-later
"""Readers of height maps: one module for each file format, the choice of a channel, and the registry of readers."""
