# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared basics: the error shown to users, atomic file writing, strict JSON and zip, OpenEXR, processes, progress."""
