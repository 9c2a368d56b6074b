# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators, one in each file. An operator calls an action (addon/actions), which it loads when its button is
pressed."""
