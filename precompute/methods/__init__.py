# SPDX-License-Identifier: GPL-3.0-or-later
"""The ways to evaluate the spectrum of a relief: the thesis's own, its baselines, and ours."""
