# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps that level and repair a scan before a bake, and their pipeline."""
