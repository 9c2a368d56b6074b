# SPDX-License-Identifier: GPL-3.0-or-later
"""Scripts that build and render the sample scenes, and run the demo with its report."""
