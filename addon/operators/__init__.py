# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators, one in each file. An operator calls a function of addon/workflow/, which is imported when the button
is pressed."""
