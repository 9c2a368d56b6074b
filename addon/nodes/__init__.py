# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees that read like their formulas."""
