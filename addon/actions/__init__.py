# SPDX-License-Identifier: GPL-3.0-or-later
"""What operators and the command line share."""
