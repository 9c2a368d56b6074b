# SPDX-License-Identifier: GPL-3.0-or-later
"""Scripts that model the sample snake and its stage, render it from several views, and run the demo with its report."""
