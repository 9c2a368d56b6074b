# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of colours: direction pairs and error metrics."""
