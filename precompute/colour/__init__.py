# SPDX-License-Identifier: GPL-3.0-or-later
"""From spectra to colours: the observer, working spaces, colour differences."""
