# SPDX-License-Identifier: GPL-3.0-or-later
"""The Direct response: the node group that reads a bake's table, and loading the bake's image."""
