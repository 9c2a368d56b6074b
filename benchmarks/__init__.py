# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks, which print or write the numbers of the reports: `python -m benchmarks NAME` runs one."""
