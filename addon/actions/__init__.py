# SPDX-License-Identifier: GPL-3.0-or-later
"""What the buttons and the command line do; both call the same functions."""
