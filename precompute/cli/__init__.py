# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line `python -m precompute VERB`: one file for each verb."""
