# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface: height maps, their readers, levelling, samples, periods, and the relief made ready for transforms."""
