# SPDX-License-Identifier: GPL-3.0-or-later
"""Readers of height maps: a module for each file format, the choice of a channel, and the registry that lists all
readers."""
