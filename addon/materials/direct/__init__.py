# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct: a bake's table read by nodes, one lamp at a time."""
