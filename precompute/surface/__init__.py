# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces: height maps, the readers of their files, sample surfaces, levelling, filling of holes, periods, and the
relief.

A relief is a height map that is ready for the Fourier transform."""
