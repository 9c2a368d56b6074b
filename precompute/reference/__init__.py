# SPDX-License-Identifier: GPL-3.0-or-later
"""The exact answers of both models of coherence, against which everything else is measured."""
