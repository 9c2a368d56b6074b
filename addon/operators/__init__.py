# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators, one in each file. Each calls a function of addon/workflow/, imported when the button is pressed."""
