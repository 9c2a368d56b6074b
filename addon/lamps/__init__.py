# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's lamps, as properties that materials read."""
