# SPDX-License-Identifier: GPL-3.0-or-later
"""Running precompute in a separate process, with progress and cancelling."""
