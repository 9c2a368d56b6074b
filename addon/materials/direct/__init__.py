# SPDX-License-Identifier: GPL-3.0-or-later
"""The Direct response: a bake's table, read by nodes."""
