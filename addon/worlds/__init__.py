# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene's world as Cycles renders it, and its compact bright parts fitted by a few sources."""
