# SPDX-License-Identifier: GPL-3.0-or-later
"""The exact results of both models of coherence, against which everything else is measured."""
