# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra of a relief's phasor: exact ones, their series in s, and what resamples them onto (u, v)."""
