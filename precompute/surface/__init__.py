# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces: height maps and their file readers, sample surfaces, levelling, hole filling, periods, and reliefs.

A relief is a height map prepared for the Fourier transform."""
