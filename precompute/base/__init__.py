# SPDX-License-Identifier: GPL-3.0-or-later
"""What every room stands on: the failure that a user reads, files written whole, progress."""
