# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra of a relief's phasor: exact spectra, their series in s, and resampling onto (u, v)."""
