# SPDX-License-Identifier: GPL-3.0-or-later
"""Readers of files, one format each."""
