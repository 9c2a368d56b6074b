# SPDX-License-Identifier: GPL-3.0-or-later
"""Building node trees: a builder whose code reads like its formula, the sockets of groups, and the layout of nodes."""
