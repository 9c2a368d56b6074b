# SPDX-License-Identifier: GPL-3.0-or-later
"""From spectra to colours: the CIE observer, working spaces, colour differences."""
