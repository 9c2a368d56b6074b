# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts spectra to colours: the CIE observer, working spaces, colour differences."""
