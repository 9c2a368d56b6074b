# SPDX-License-Identifier: GPL-3.0-or-later
"""Scripts that write the CSV tables of precompute/, from public sources."""
