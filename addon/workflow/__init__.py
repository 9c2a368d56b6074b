# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of an artist's work, from import to render. Both the buttons and the command line call these functions."""
