# SPDX-License-Identifier: GPL-3.0-or-later
"""The laboratory's verbs of `./dev grating VERB`, one file for each verb."""

from precompute.cli import parser

VERBS = {
    "check": "recompute a bake's error from its files alone",
    "evaluate": "the grating period that follows from each method's colours",
    "efficiency": "a grating's efficiencies against their closed forms",
    "benchmark": "speed against error: every method on the same surfaces",
}
PACKAGES = parser.PACKAGES | {__package__: VERBS}
