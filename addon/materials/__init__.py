# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups and materials, built from code."""
