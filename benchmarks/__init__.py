# SPDX-License-Identifier: GPL-3.0-or-later
"""What prints the figures of the reports: each module runs with `python -m benchmarks.NAME`."""
